#include "core/link/console.hpp"

#include "core/base/text.hpp"

namespace chladni {

namespace {

constexpr const char* kHelp =
    "expected: touch X_UM Y_UM | lift | frequency MILLIHERTZ | waveform NAME | info | faults";

// What keeps a finger from being felt, and what else stands, a line each.
void print_standing(const Device& device) {
  for (uint32_t k = 0; k < kFaultCauses; ++k) {
    const auto cause = static_cast<FaultCause>(k);
    if (!device.faults().stands(cause)) continue;
    Line80 line;
    device.print(line.add("stands: ").add(to_text(cause)).text());
  }
}

void print_info(const Device& device) {
  device.print(to_text(device.state()));
  print_standing(device);
  device.print(to_text(device.table_status()));
  device.print(to_text(device.config_status()));
  device.print(to_text(device.input().health()));
  const CoilHeat& heat = device.heat();
  Line80 supply;
  device.print(supply.add(device.supply().mean_ma()).add(" mA").text());
  for (uint32_t k = 0; k < device.config().channels; ++k) {
    Line80 line;
    line.add("coil ").add(k).add(": ").add_milli(heat.rise_dk(k) * 100U).add(" K");
    device.print(line.text());
  }
}

void print_faults(const Device& device) {
  const FaultLog& faults = device.faults();
  if (faults.count() == 0) device.print("no faults");
  for (uint32_t k = 0; k < faults.kept(); ++k) {
    const Fault& fault = faults.at(k);
    Line80 line;
    line.add_milli(fault.at_ms).add(" s: ").add(to_text(fault.cause)).add(" (").add(fault.detail);
    device.print(line.add(")").text());
  }
}

// These return false if the words after the command make no sense.
bool touch(Device& device, Reader& words) {
  Place place{};
  if (!words.number(&place.x_um) || !words.number(&place.y_um) || !words.at_end()) return false;
  if (device.state() == DeviceState::kFault) {
    print_standing(device);
    return true;
  }
  device.touch(place);
  device.print("ok");
  return true;
}

bool select_frequency(Device& device, Reader& words) {
  int32_t millihertz = 0;
  if (!words.number(&millihertz) || !words.at_end() || millihertz <= 0) return false;
  if (!device.table().is_loaded()) {
    device.print(to_text(device.table_status()));
  } else if (device.state() != DeviceState::kIdle) {
    device.print("lift the finger first");
  } else {
    device.print(to_text(device.select_frequency(static_cast<uint32_t>(millihertz))));
  }
  return true;
}

bool set_waveform(Device& device, Reader& words) {
  for (uint32_t k = 0; k < kWaveforms; ++k) {
    if (!words.word(to_text(static_cast<Waveform>(k))) || !words.at_end()) continue;
    device.set_waveform(static_cast<Waveform>(k));
    device.print("ok");
    return true;
  }
  return false;
}

bool run(Device& device, const char* line) {
  Reader words(line);
  if (words.word("touch")) return touch(device, words);
  if (words.word("lift") && words.at_end()) {
    device.lift();
    device.print("ok");
    return true;
  }
  if (words.word("frequency")) return select_frequency(device, words);
  if (words.word("waveform")) return set_waveform(device, words);
  if (words.word("info") && words.at_end()) {
    print_info(device);
    return true;
  }
  if (words.word("faults") && words.at_end()) {
    print_faults(device);
    return true;
  }
  return false;
}

}  // namespace

void run_command(Device& device, const char* line) {
  if (!run(device, line)) device.print(kHelp);
}

}  // namespace chladni
