# A model of how ESP-IDF 5.5.3 learns what a component needs: each CMakeLists.txt is run in script
# mode, where only registering and its few companions are defined, and registering ends the file.
#
#   cmake -DCOMPONENT_FILE=… -P component_model.cmake
#
# What it leaves out: the build properties that companions would read come back empty, but for the
# target (-DIDF_TARGET=…).
macro(idf_build_get_property variable property)
  set(${variable} "")
  if("${property}" STREQUAL "IDF_TARGET")
    set(${variable} "${IDF_TARGET}")
  endif()
endmacro()
macro(idf_component_get_property variable)
  set(${variable} "")
endmacro()
macro(require_idf_targets)
endmacro()

macro(idf_component_register)
  set(options WHOLE_ARCHIVE)
  set(multiple SRCS SRC_DIRS EXCLUDE_SRCS INCLUDE_DIRS PRIV_INCLUDE_DIRS LDFRAGMENTS REQUIRES
               PRIV_REQUIRES REQUIRED_IDF_TARGETS EMBED_FILES EMBED_TXTFILES)
  cmake_parse_arguments(_ "${options}" "KCONFIG;KCONFIG_PROJBUILD" "${multiple}" ${ARGN})
  if(__UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "unknown arguments: ${__UNPARSED_ARGUMENTS}")
  endif()
  foreach(kind SRCS LDFRAGMENTS INCLUDE_DIRS PRIV_INCLUDE_DIRS)
    foreach(path ${__${kind}})
      get_filename_component(found "${path}" ABSOLUTE BASE_DIR "${COMPONENT_DIR}")
      if(NOT EXISTS "${found}")
        message(FATAL_ERROR "${kind} names ${path}, which is not there")
      endif()
      if(kind STREQUAL "SRCS")
        message(STATUS "source ${found}")
      endif()
    endforeach()
  endforeach()
  message(STATUS "requires ${__REQUIRES} ${__PRIV_REQUIRES}")
  set(IS_REGISTERED TRUE)
  return()
endmacro()

get_filename_component(COMPONENT_DIR "${COMPONENT_FILE}" DIRECTORY)
include("${COMPONENT_FILE}")
if(NOT IS_REGISTERED)
  message(FATAL_ERROR "${COMPONENT_FILE} registers nothing")
endif()
