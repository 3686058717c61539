"""How much of chip/ its tests on the fake reach."""

from __future__ import annotations

from pathlib import Path

from firmware import test_chip_carrier as carrier
from firmware import test_chip_crashes as crashes
from firmware import test_chip_layer as layer
from firmware import test_chip_sensing as sensing
from firmware.chip_process import branches
from firmware.chip_started import on_each_chip

# An ESP32-S3 never starts a second group of channels: 11 of its 334 branches.
LEAST = {"esp32": 0.95, "esp32s3": 0.90}


@on_each_chip
def test_the_fake_reaches_the_branches_of_chip(chip_program: Path) -> None:
    """What no scenario takes was not tested; by gcov, branches of exceptions aside."""
    layer.calls_made(chip_program)
    layer.test_every_failing_call_leaves_outputs_off_or_harmless_and_a_link_that_answers(
        chip_program
    )
    for way in ("panic", "brownout"):
        layer.test_every_way_down_leaves_the_gates_low(chip_program, way)
    layer.test_an_interrupt_that_would_answer_another_timer_is_not_started(chip_program)
    layer.test_a_restart_cuts_the_outputs_first(chip_program)
    layer.test_without_a_wire_it_starts_again_with_outputs_off(chip_program)
    layer.test_missing_partitions_are_said(chip_program)
    for reason in (3, 4, 5, 6, 9, 99):
        layer.test_why_it_started_is_kept(chip_program, reason, "known")
    layer.test_gates_above_31_play_and_are_cut(chip_program)
    layer.test_pins_that_cannot_be_leave_the_link(chip_program)
    layer.test_an_open_network_and_a_flood_of_rubbish(chip_program)
    layer.test_tables_that_have_too_little_room_are_said(chip_program)
    layer.test_an_interrupt_just_before_the_next_drops_a_duty_and_waits_for_nothing(chip_program)
    for option in ("mute", "stuck"):
        layer.test_a_panel_that_fails_is_looked_for_and_the_link_goes_on(chip_program, option)
    for call in ("esp_partition_erase_range:1", "esp_partition_write:3"):
        layer.test_flash_that_fails_refuses_a_configuration_and_keeps_the_old(chip_program, call)
    if chip_program.name == "esp32":  # which alone has two groups of channels
        carrier.test_sixteen_channels_play_on_both_groups(chip_program)
        for apart in (-200, 200):
            carrier.test_groups_that_do_not_start_together_are_not_played(chip_program, apart)
    carrier.test_bridges_turn_by_their_signs(chip_program)
    carrier.test_a_carrier_that_will_not_stand_still_is_said_once(chip_program)
    carrier.test_writes_are_moved_away_from_the_carrier_s_end(chip_program)
    carrier.test_a_timer_that_cannot_be_moved_is_said_once(chip_program)
    layer.test_a_panel_without_its_lines_and_a_device_without_partitions(chip_program)
    for call in ("ledc_timer_config", "esp_wifi_init"):
        crashes.test_crashes_in_a_row_end_in_a_wire_that_answers(chip_program, call, crashes.PANIC)
    crashes.test_the_wire_answers_before_a_radio_that_crashes_and_after_it(
        chip_program, "esp_wifi_init"
    )
    for call in ("esp_partition_read", "gpio_config"):
        crashes.test_a_start_that_crashes_before_all_else_answers_as_a_blank_device(
            chip_program, call
        )
    sensing.test_what_the_converter_reads_is_found_by_the_phase_of_the_duty(chip_program)
    sensing.test_values_that_were_not_fetched_end_the_reading(chip_program)
    for call in sensing.CALLS:
        sensing.test_a_converter_that_does_not_start_is_said(chip_program, call)
    taken, total, missed = branches(chip_program)
    assert taken / total >= LEAST[chip_program.name], f"{taken} of {total}: {sorted(missed)}"
