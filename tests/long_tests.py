"""Which tests `make test` leaves to `make long`: those that take two seconds of a core and more.

What they ask is asked in a smaller way by tests that stay. `make long` runs all of them, `.ci/run`
one third: every third entry, which ones by the commit. The longest, of which others ask the same on
another board or by another command, are left to `make soak`.
"""

from __future__ import annotations

import os
from collections.abc import Sequence

import pytest

LONG = (
    "calibration/test_calibration.py::test_a_hidden_plate_is_found[4]",
    "calibration/test_calibration.py::test_a_hidden_plate_is_found[8]",
    "calibration/test_calibration.py::test_any_coil_may_be_reversed[coils0]",
    "calibration/test_begun_readings.py::test_a_host_that_was_away",
    "calibration/test_begun_readings.py::test_calibrate_goes_on",
    "calibration/test_sound.py::test_boards_on_feet_and_on_nothing_are_found_by_ear[True]",
    "calibration/test_slopes.py",
    "calibration/test_flux.py::test_coils_that_play_quietly_are_read_for_longer",
    "calibration/test_disturbed_readings.py",
    "calibration/test_feet.py::test_a_board_that_is_as_drawn_keeps_its_rigid_screws",
    "calibration/test_unlike_pairs.py",
    "calibration/test_coil_readings.py::test_what_is_too_loud_is_said_and_read_at_half",
    "calibration/test_sound.py::test_a_recording_is_calibrated_with",
    "chain/test_chain.py::test_plate_commands_answer_and_draw",
    "chain/test_click_score.py::test_a_reckoned_click_is_one_that_is_played",
    "chain/test_examples.py::test_a_device_of_another_board_is_left_alone",
    "chain/test_examples.py::test_an_example_runs_and_draws[design]",
    "chain/test_examples.py::test_an_example_runs_and_draws[swipe]",
    "chain/test_examples.py::test_an_example_runs_and_draws[table]",
    "chain/test_examples.py::test_the_device_on_a_port_plays",
    "chain/test_felt.py::test_tables_comparisons_and_touches_speak_of_them_too",
    "chain/test_over_frequency.py::test_a_plate_that_resonates_is_solved_closer_there",
    "chain/test_unknown_finger.py::test_a_bias_that_comes_up_with_the_touch_is_told_of",
    "chain/test_unknown_finger.py::test_a_click_beside_one_finger_is_reckoned_within_3_db_of_the_pins",
    "chain/test_unknown_finger.py::test_the_loudest_other_finger_is_found_wherever_it_lies",
    "chain/test_unknown_finger.py::test_a_board_for_several_knows_all_fingers",
    "chain/test_unknown_finger.py::test_places_have_what_each_of_them_has_alone",
    "chain/test_played_effect.py::test_a_click_reaches_its_finger_in_time_and_leaves_the_other_still",
    "chain/test_played_effect.py::test_a_finger_alone_is_emulated_by_responses_too",
    "chain/test_played_effect.py::test_a_switchs_bias_stands_before_an_effect_and_is_told_apart",
    "chain/test_played_effect.py::test_an_area_or_a_host_in_micrometres_moves_a_finger_by_as_much",
    "chain/test_played_effect.py::test_a_steady_tone_moves_a_finger_as_the_plate_at_its_frequency_says",
    "chain/test_played_effect.py::test_fingers_are_on_a_plate_that_the_device_does_not_know",
    "chain/test_two_effects.py::test_the_command_plays_an_effect_under_each_finger",
    "chain/test_swipe.py::test_every_report_of_a_swipe_is_scored",
    "chain/test_table_score.py::test_a_diode_without_a_floor_bends_what_the_pins_say",
    "chain/test_template.py::test_the_template_can_be_built_and_scored",
    "design/test_cluster.py",
    "design/test_layouts.py::test_a_quincunx_is_among_the_layouts_that_a_search_begins_with",
    "design/test_layouts.py::test_layouts_for_several_are_rated_as_their_boards_score",
    "design/test_search.py::test_a_search_with_lists_says_nothing_of_the_boards_it_left_out",
    "design/test_search.py::test_time_ends_layouts_and_the_search_goes_on_from_those_it_used",
    "design/test_search.py::test_more_boards_go_on_from_fewer_and_time_ends_a_search",
    "design/test_search.py::test_the_command_writes_a_board_that_scores_as_said",
    "docs/test_pages.py::test_every_block_of_a_page_runs_or_names_what_stands_in[README.md]",
    "docs/test_pages.py::test_every_block_of_a_page_runs_or_names_what_stands_in[calibrate.md]",
    "docs/test_pages.py::test_every_block_of_a_page_runs_or_names_what_stands_in[commands.md]",
    "docs/test_pages.py::test_every_block_of_a_page_runs_or_names_what_stands_in[effects.md]",
    "docs/test_pages.py::test_every_block_of_a_page_runs_or_names_what_stands_in[first-boot.md]",
    "docs/test_pages.py::test_every_block_of_a_page_runs_or_names_what_stands_in[first-buzz.md]",
    "docs/test_pages.py::test_every_block_of_a_page_runs_or_names_what_stands_in[flash.md]",
    "docs/test_pages.py::test_every_block_of_a_page_runs_or_names_what_stands_in[own-board.md]",
    "docs/test_pages.py::test_every_block_of_a_page_runs_or_names_what_stands_in[parts.md]",
    "docs/test_pages.py::test_every_block_of_a_page_runs_or_names_what_stands_in[start.md]",
    "docs/test_site.py",
    "drives/test_as_built.py::test_a_board_with_a_layer_gets_no_film_besides",
    "drives/test_as_built.py::test_every_row_is_worse_than_the_board_as_drawn_where_it_must_be",
    "drives/test_as_built.py::test_the_last_row_alone_is_the_same",
    "drives/test_board_score.py::test_boards_that_come_out_otherwise_focus_all_the_same",
    "drives/test_board_score.py::test_the_border_of_the_active_area_has_a_row_of_its_own",
    "drives/test_checkpoint.py::test_any_file_gives_results_or_words_and_is_not_lost",
    "drives/test_compare.py",
    "drives/test_fingers_as_built.py",
    "drives/test_fingers_score.py::test_fingers_beside_their_places_and_pressing_hard_lose_little",
    "drives/test_fingers_score.py::test_two_fingers_of_a_strip_are_kept_apart",
    "drives/test_fingers_score.py::test_within_tolerances_most_is_left",
    "drives/test_focus.py::test_a_general_cone_solver_finds_the_same_focus",
    "drives/test_focus.py::test_a_higher_floor_costs_silence_and_a_lower_one_buys_it",
    "drives/test_focus.py::test_solve_has_options_of_a_focus_and_says_what_gave_way",
    "drives/test_focus_on_elements.py::test_second_fingers_of_strip5_are_those_on_finite_elements",
    "drives/test_optimality.py::test_random_starts_find_nothing_better",
    "drives/test_sensitivity.py::test_a_board_for_fingers_is_rated_by_what_two_of_them_get",
    "drives/test_sensitivity.py::test_foam_that_carries_a_board_decides_its_level",
    "drives/test_sensitivity.py::test_forces_change_no_more_than_their_own_share",
    "drives/test_sensitivity.py::test_the_command_sorts_and_draws",
    "drives/test_traces.py::test_any_change_of_a_traces_bytes_gives_the_same_chain_or_words",
    "drives/test_workers.py::test_what_a_killed_worker_had_is_done_again",
    "drives/test_workers.py::test_workers_end_with_a_parent_that_could_not_tell_them",
    "firmware/test_boot_log.py::test_crashes_are_forgotten_after_a_good_while",
    "firmware/test_chip_carrier.py",
    "firmware/test_chip_crashes.py::test_the_wire_answers_before_a_radio_that_crashes_and_after_it",
    "firmware/test_chip_iram.py",
    "firmware/test_device_suite.py::test_the_suite_takes_an_image_from_blank_flash_to_a_touch[all]",
    "firmware/test_device_suite.py::test_without_an_image_or_an_emulator_the_suite_is_skipped",
    "firmware/test_everything.py",
    "firmware/test_finger_drives.py::test_a_processor_with_a_floating_point_unit_finds_drives_in_time",
    "firmware/test_heat.py::test_any_order_of_touches_streams_and_resets",
    "firmware/test_iram.py",
    "firmware/test_native_build.py",
    "firmware/test_pins.py::test_both_sides_judge_five_thousand_configurations_alike",
    "firmware/test_pins.py::test_random_configurations_never_cost_the_link",
    "firmware/test_processors.py::test_cuts_and_mirrors_everywhere_cost_a_lookup_no_more",
    "firmware/test_processors.py::test_stacks_stay_as_small_as_the_documentation_says",
    "host/figures/test_wide_boards.py",
    "host/manufacture/test_drawing.py::test_a_drawing_is_the_same_bytes_in_every_run",
    "host/manufacture/test_wiring.py::test_texts_lie_on_nothing_and_wires_are_straight",
    "host/test_calibrate.py::test_a_board_is_calibrated_and_its_file_is_one",
    "host/test_calibrate.py::test_micrometres_stand_beside_decibels",
    "host/test_endings.py::test_a_full_disk_is_said_and_leaves_what_was_there",
    "host/test_fingers_command.py::test_a_board_as_built_has_rows_of_its_own",
    "host/test_fingers_command.py::test_an_emulated_device_plays_nearly_what_the_board_would",
    "host/test_bank_commands.py::test_noise_of_a_bank_is_compared_with_no_other",
    "host/test_played_pairs.py::test_pairs_of_a_bank_lie_in_its_areas",
    "host/test_played_pairs.py::test_pairs_of_two_effects_have_what_each_has_alone",
    "host/test_played_pairs.py::test_without_a_table_it_is_told_what_plays_and_each_of_few_pairs",
    "host/test_fingers_command.py::test_two_fingers_of_ones_own_are_scored_and_drawn",
    "host/test_fingers_command.py::test_a_score_of_a_board_for_several_shows_pairs",
    "host/test_own_device.py::test_what_was_written_outlasts_a_pulled_plug",
    "host/test_refit.py::test_the_file_is_kept_and_its_foam_is_stiffer",
    "host/test_responses_commands.py::test_a_table_of_responses_is_built_and_asked_for_by_the_board_file",
    "host/test_rom.py::test_a_table_goes_to_the_slot_not_in_use_and_nowhere_else",
    "host/test_solver_commands.py",
    "host/test_streaming.py::test_a_host_that_is_later",
    "host/test_tables_for_people.py::test_tables_speak_no_python[board",
    "sim/test_crowded.py::test_a_board_that_cannot_be_followed_names_what_nearly_touches",
    "sim/test_crowded.py::test_estimates_hold_where_features_nearly_touch",
    "sim/test_crowded.py::test_memory_is_told_beforehand",
    "sim/test_flyback.py::test_a_board_says_from_where_on_its_coils_play_in_proportion",
    "sim/test_foundation.py::test_patches_under_discs_match_points_all_over_the_plate",
    "sim/test_foundation.py::test_one_patch_is_a_stiffer_sheet_with_its_cut_outs",
    "sim/test_foundation.py::test_cut_outs_match_finite_elements",
    "sim/test_held_edges.py::test_a_magnet_close_to_a_held_edge_takes_no_larger_basis",
    "sim/test_held_edges.py::test_a_supported_plate_with_a_screw_and_a_magnet_matches_finite_elements",
    "sim/test_large_sheets.py::test_coils_far_from_the_edges_do_not_feel_them",
    "sim/test_magnetic_coupling.py::test_what_moves_a_magnet_is_what_the_magnet_moves",
    "sim/test_panel_layer.py::test_show_says_what_a_panel_does",
    "sim/test_pressed.py::test_a_pressed_sheet_is_that_of_the_differential_equations[0.3]",
    "sim/test_pressed.py::test_a_pressed_sheet_is_that_of_the_differential_equations[3.0]",
    "sim/test_pressed.py::test_free_sheets_in_splines_are_those_of_the_plate",
    "sim/test_random_against_elements.py",
    "sim/test_response.py::test_a_damped_plate_driven_high_is_endless",
    "sim/test_response.py::test_a_kept_plate_answers_as_one_asked_for_the_first_time",
    "sim/test_response.py::test_error_estimates_hold_on_random_boards",
    "sim/test_ritz_plate.py::test_fields_at_160_hz_match_finite_elements",
    "sim/test_supports.py::test_a_sprung_screw_lies_between_no_screw_and_a_held_one",
    "studio/test_boards.py::test_a_coil_that_moves",
    "studio/test_boards.py::test_a_table_is_built_for_what_is_chosen",
    "studio/test_boards.py::test_the_page_moves_a_coil",
    "studio/test_designs.py::test_a_search_tells_its_boards_and_finds_what_python_finds",
    "studio/test_designs.py::test_a_search_for_several_fingers_is_shown_by_several",
    "studio/test_designs.py::test_the_page_draws_a_front_and_shows_a_board_of_it",
    "studio/test_device.py::test_a_finger_is_lifted_when_the_studio_ends",
    "studio/test_device.py::test_a_port_that_vanishes_is_said_and_the_page_plays_on",
    "studio/test_fingers_page.py::test_a_shift_click",
    "studio/test_fingers_page.py::test_tone_and_level",
    "studio/test_page.py::test_a_drag_ends_where_the_finger_is",
    "studio/test_fingers_page.py::test_the_form_adds",
    "studio/test_fingers_page.py::test_the_picture_is_of_all_signals_or_of_one",
    "studio/test_views.py::test_a_page_finds_its_server_again",
    "tables/test_between_regions.py",
    "tables/test_format.py::test_readers_agree_on_flipped_bits_that_the_crc_allows",
    "tables/test_responses.py::test_readers_agree",
    "tables/test_several_fingers.py::test_the_smallest_table_within_the_limit_is_taken",
    "tables/test_table_hard_cases.py::test_a_mirror_in_one_direction_only_is_used",
    "tables/test_table_hard_cases.py::test_one_actuator_and_sixteen",
    "drives/test_search_cost.py::test_tables_for_fingers_come_of_less_and_play_on_less",
    "host/test_bank_commands.py::test_a_boards_own_level_is_taken_out_where_it_is_asked_for",
    "host/test_two_presses.py::test_each_of_two_presses_is_told_beside_the_other",
    "host/test_ports.py::test_the_emulated_wire_follows_its_configuration",
    "host/test_verdicts.py::test_people_read_it_first_and_programs_by_its_key",
    "spice/test_bridge_sensing.py",
    "calibration/test_laboratory.py::test_what_is_wrong_is_told_from_the_data[axes-",
    "calibration/test_calibration.py::test_without_windings_the_drawn_motion_is_taken_off_the_flux",
    "chain/test_played_effect.py::test_an_envelope_is_met_within_a_decibel",
    "studio/test_effects.py::test_a_second_finger_has_hardly_any_of_a_click",
    "chain/test_felt.py::test_a_table_makes_up_for_the_finger_where_it_matters",
    "chain/test_played_effect.py::test_a_weak_coil_that_its_device_makes_up_for",
    "host/test_kept_work.py::test_a_front_that_cannot_be_written_is_not_searched_again",
    "host/test_calibrate.py::test_a_plate_that_a_file_describes_is_found",
    "calibration/test_sound.py::test_what_is_clipped_a_little_is_refused_and_what_is_quiet_is_not",
    "calibration/test_sound.py::test_recordings_of_no_sweep_are_refused",
    "chain/test_template.py::test_a_sweep_tells_the_plate_from_the_latch",
    "host/test_fingers_command.py::test_a_device_needs_a_table_of_the_board_with_responses",
    "firmware/test_processors.py::test_a_built_table_is_read_and_looked_up_alike_and_in_time",
    "firmware/test_chip_crashes.py::test_crashes_in_a_row_end_in_a_wire_that_answers[ledc_timer_config-4-esp32]",
    "firmware/test_chip_sensing.py::test_values_that_were_not_fetched_end_the_reading[esp32s3]",
    "spice/test_sensing.py::test_the_reference_goes_the_same_way_as_a_coil",
    "spice/test_sensing.py::test_a_driven_coil_hurts_nothing",
    "studio/test_fingers.py::test_one_finger_of_a_board_for_several_plays_the_loudest_drive",
    "chain/test_one_objective.py::test_every_command_takes_the_objective_of_the_file[-ssim]",
    "design/test_search.py::test_a_search_beats_its_starts",
    "tables/test_several_fingers.py::test_drives_and_responses_share_a_table",
    "drives/test_workers.py::test_a_worker_that_is_killed_again_ends_the_work_with_a_remedy",
    "firmware/test_limits_walk.py::test_no_order_of_few_requests_lifts_a_limit[1]",
    "design/test_search.py::test_a_search_that_was_stopped_goes_on",
    "host/test_verdicts.py::test_what_stiffer_foam_leaves_is_told_with_what_fingers_get",
    "spice/test_sensing.py::test_the_carrier_that_a_neighbour_couples_in_leaves_room",
    "calibration/test_calibration.py::test_any_coil_may_be_reversed[coils2]",
    "calibration/test_coil_readings.py::test_the_firmware_reads_what_the_arithmetic_says[switch-12-4]",
    "calibration/test_coil_readings.py::test_the_firmware_reads_what_the_arithmetic_says[bridge-11-8]",
    "sim/test_pressed.py::test_vibration_about_a_press_is_the_press_of_a_little_more",
    "sim/test_pressed.py::test_a_light_press_is_that_of_kelvin_functions",
    "tables/test_table_hard_cases.py::test_two_frequencies_are_two_sections",
    "chain/test_table_score.py::test_the_pins_focus_all_over_the_board[quiet5]",
    "host/test_tolerance.py::test_a_frequency_asked_for_twice_is_stored_once",
    "host/test_own_device.py::test_a_hidden_plate_is_of_a_board_that_is_served",
    "docs/test_troubleshooting.py::test_a_message_of_the_page_is_in_the_program_s_words",
)
"""Beginnings of their names."""
LONGEST = (
    "calibration/test_laboratory.py::test_the_command_writes_the_board",
    "calibration/test_sound.py::test_a_dead_coil_at_an_end_is_no_other[0]",
    "host/test_calibrate.py::test_an_accelerometer_finds_it_too",
    "calibration/test_sound.py::test_a_dead_coil_at_an_end_is_no_other[5]",
    "calibration/test_accelerometer.py::test_a_board_is_found_by_an_accelerometer_at_two_places",
    "calibration/test_accelerometer.py::test_a_sensor_on_every_coil_tells_forces_and_level",
    "calibration/test_calibration.py::test_a_weight_on_the_board_is_noticed",
    "calibration/test_calibration.py::test_any_coil_may_be_reversed[coils1]",
    "calibration/test_flux.py::test_all_coils_read_flux_at_one_level",
    "calibration/test_laboratory.py::test_another_board_and_too_little_are_refused",
    "calibration/test_laboratory.py::test_foam_is_found_in_patches",
    "calibration/test_laboratory.py::test_the_board_that_has_these_fields_is_found",
    "calibration/test_laboratory.py::test_what_is_wrong_is_told_from_the_data[x-x mirrored]",
    "calibration/test_laboratory.py::test_what_is_wrong_is_told_from_the_data[y-y mirrored]",
    "calibration/test_sound.py::test_boards_on_feet_and_on_nothing_are_found_by_ear[False]",
    "calibration/test_sound.py::test_boards_on_feet_and_on_nothing_are_found_by_ear[True]",
    "calibration/test_sound.py::test_clocks_that_differ_are_told_from_another_plate",
    "calibration/test_sound.py::test_foam_forces_and_faults_are_found_by_ear[2]",
    "calibration/test_sound.py::test_foam_forces_and_faults_are_found_by_ear[3]",
    "chain/test_all_regions.py::test_the_pins_field_is_the_solvers_in_every_region",
    "chain/test_played_effect.py::test_a_tone_of_less_level_is_as_much_weaker",
    "chain/test_played_effect.py::test_an_area_or_a_host_in_micrometres_moves_a_finger_by_as_much[None]",
    "chain/test_played_effect.py::test_the_command_plays_and_draws",
    "chain/test_score_and_table.py::test_a_small_board_is_scored_at_more_places",
    "chain/test_score_and_table.py::test_a_table_keeps_what_the_score_said_within_1_db[feet-True]",
    "chain/test_score_and_table.py::test_a_table_keeps_what_the_score_said_within_1_db[quiet5-False]",
    "chain/test_table_score.py::test_a_pressing_finger_leaves_micrometres_everywhere[pad16]",
    "chain/test_table_score.py::test_pins_play_what_the_table_says_for_the_place[pad16]",
    "chain/test_table_score.py::test_the_pins_focus_all_over_the_board[pad16]",
    "chain/test_two_effects.py::test_drives_of_two_effects_share_the_coils",
    "chain/test_two_effects.py::test_fingers_with_an_effect_each_have_rested_where_switches_have_a_bias",
    "chain/test_two_effects.py::test_pairs_are_on_a_plate_that_the_device_does_not_know",
    "design/test_cluster.py::test_a_search_finds_the_same_on_a_cluster",
    "design/test_search.py::test_two_processes_find_the_same",
    "docs/test_site.py::test_broken_references_end_the_build",
    "docs/test_trial.py::test_a_port_is_that_of_an_emulated_device",
    "drives/test_board_score.py::test_board_score_answers_and_draws",
    "drives/test_board_score.py::test_shipped_boards_focus_as_well_as_was_known[pad16]",
    "drives/test_board_score.py::test_the_border_of_the_active_area_has_a_row_of_its_own[quiet16-11.0]",
    "drives/test_hard_cases.py::test_sixty_four_actuators_reach_higher",
    "drives/test_optimality.py::test_random_starts_find_nothing_better[paper]",
    "drives/test_sensitivity.py::test_feet_that_carry_a_board_decide_its_level",
    "drives/test_sensitivity.py::test_isolation_lost_is_of_the_worst_tenth_as_fingers_has_it",
    "firmware/test_chip_branches.py::test_the_fake_reaches_the_branches_of_chip[esp32]",
    "firmware/test_chip_branches.py::test_the_fake_reaches_the_branches_of_chip[esp32s3]",
    "firmware/test_chip_iram.py::test_functions_marked_for_iram_are_functions_of_it[esp32s3]",
    "firmware/test_chip_layer.py::test_every_failing_call_leaves_outputs_off_or_harmless_and_a_link_that_answers[esp32s3]",
    "firmware/test_device_suite.py::test_the_suite_takes_an_image_from_blank_flash_to_a_touch[two]",
    "firmware/test_iram.py::test_what_the_interrupt_reaches_is_closed_and_lies_in_ram[RISC-V rv32imc]",  # noqa: E501
    "firmware/test_limits_walk.py::test_no_order_of_few_requests_lifts_a_limit[2]",
    "firmware/test_pins.py::test_random_configurations_never_cost_the_link[esp32s3]",
    "firmware/test_processors.py::test_cuts_and_mirrors_everywhere_cost_a_lookup_no_more[RISC-V rv32imc]",  # noqa: E501
    "host/figures/test_wide_boards.py::test_solve_draws_with_and_without_a_trace",
    "host/test_bank_commands.py::test_a_press_on_a_key_is_scored_under_the_finger",
    "host/test_calibrate.py::test_a_device_on_a_port_measures_its_board",
    "host/test_fingers_command.py::test_an_emulated_device_plays_nearly_what_the_board_would[board0]",
    "host/test_own_device.py::test_a_board_of_ones_own_plays",
    "host/test_played_pairs.py::test_pairs_have_what_each_of_them_has_alone",
    "host/test_verdicts.py::test_a_board_for_several_is_scored_by_two_fingers_within_tolerances",
    "host/test_verdicts.py::test_a_board_for_several_shows_no_focus_unless_it_is_asked_for",
    "host/test_verdicts.py::test_a_board_is_tried_on_other_sheets_and_foams",
    "sim/test_metrics.py::test_contrast_never_exceeds_its_limit",
    "sim/test_pressed.py::test_fingers_far_apart_press_as_each_alone",
    "spice/test_bridge_sensing.py::test_the_amplifier_reads_a_coil_at_ground_as_one_at_the_supply[6000.0-0.005]",
    "spice/test_bridge_sensing.py::test_the_carrier_that_a_neighbour_couples_in_leaves_room",
    "spice/test_bridge_sensing.py::test_the_reference_is_forgotten_before_the_next_coil",
    "studio/test_boards.py::test_a_file_that_is_opened_is_read_as_everywhere",
    "studio/test_boards.py::test_two_boards_side_by_side_have_devices_and_tables_of_their_own",
    "studio/test_designs.py::test_one_search_runs_at_a_time_and_is_stopped_by_its_page",
    "studio/test_device.py::test_a_finger_is_lifted_when_the_studio_ends[15]",
    "studio/test_device.py::test_a_finger_is_lifted_when_the_studio_ends[1]",
    "studio/test_device.py::test_a_finger_is_lifted_when_the_studio_ends[2]",
    "tables/test_between_regions.py::test_at_places_drawn_at_random_the_limits_are_kept_too[paper-contrast]",
    "tables/test_between_regions.py::test_at_places_drawn_at_random_the_limits_are_kept_too[prototype-ssim]",
    "tables/test_format.py::test_readers_agree_on_flipped_bits_that_the_crc_allows[table1]",
    "tables/test_several_fingers.py::test_a_fixed_pitch_width_and_frequencies_are_kept",
    "tables/test_several_fingers.py::test_other_fingers_lose_as_little_as_those_that_the_build_drew",
    "tables/test_table_hard_cases.py::test_a_board_without_mirrors_stores_every_region",
    "tables/test_table_hard_cases.py::test_the_bytes_do_not_depend_on_threads",
)
"""Those that are left to `make soak`."""
ALONE = (
    "docs/test_pages.py::test_every_block_of_a_page_runs_or_names_what_stands_in[first-boot.md]",
)
"""Of them, those that run with no others beside them: their device keeps real time, and takes its
host for silent where that gets no turn for a tenth of a second."""
PART, PARTS = "CHLADNI_PART", 3
"""In the environment, 0 to 2: of `LONG` that third alone."""
WHOLE_SUITE = 2000
"""Tests, more than any part of the suite has."""


def asked_for() -> set[str]:
    """Entries of `LONG` that are to run."""
    part = os.environ.get(PART, "")
    if part and part not in map(str, range(PARTS)):
        raise pytest.UsageError(f"{PART}: {part!r}, expected 0 to {PARTS - 1}")
    return set(LONG[int(part) :: PARTS] if part else LONG)


def mark_long(items: Sequence[pytest.Item]) -> None:
    """Mark them `long`, or `soak`, as those of the thirds that are not asked for.

    Raises
    ------
    pytest.UsageError
        A name stands for no test of the whole suite, or there is no such third.
    """
    unused, asked = {*LONG, *LONGEST}, asked_for()
    for item in items:
        name = item.nodeid.removeprefix("tests/")
        if name in LONGEST:
            item.add_marker(pytest.mark.soak)
            unused.discard(name)
            continue
        for own in LONG:
            if name.startswith(own):
                item.add_marker(pytest.mark.long if own in asked else pytest.mark.soak)
                if own in ALONE:
                    item.add_marker(pytest.mark.alone)
                unused.discard(own)
    if unused and len(items) > WHOLE_SUITE:
        raise pytest.UsageError(f"tests/long_tests.py: no such tests: {', '.join(sorted(unused))}")


if __name__ == "__main__":
    # For a run of these alone: to collect the others takes as long as some of them.
    print(*sorted({f"tests/{name.partition('::')[0]}" for name in asked_for()}))
