// The device: a touch becomes a drive, and every way a touch can end turns the outputs off.
#pragma once

#include <cstdint>

#include "core/base/fault_log.hpp"
#include "core/device/host_drive.hpp"
#include "core/device/output_watch.hpp"
#include "core/device/starts.hpp"
#include "core/device/state.hpp"
#include "core/device/touch_playback.hpp"
#include "core/device/turn_clock.hpp"
#include "core/effects/finger_effects.hpp"
#include "core/generated/link_format.hpp"
#include "core/hal.hpp"
#include "core/limits/coil_heat.hpp"
#include "core/limits/supply_meter.hpp"
#include "core/sensing/coil_sense.hpp"
#include "core/storage/files/stored_bank.hpp"
#include "core/storage/files/stored_table.hpp"
#include "core/storage/flash_wear.hpp"
#include "core/storage/stored_config.hpp"
#include "core/synthesis/synthesis.hpp"
#include "core/touch/panel_watch.hpp"
#include "core/touch/touch_input.hpp"

namespace chladni {

// What clocks that wrap count from: 0 but where a wrap is to be seen without the days before it.
struct FirstCounts {
  uint32_t ms = 0;
  uint32_t samples = 0;
};

class Device {
 public:
  // Load configuration and table and get ready; outputs stay off.
  void start(const Hal& hal, const FirstCounts& first = {});
  // One turn of the main loop; call it every millisecond, and as soon as the panel calls.
  void poll();
  // One sample; call it from the sample interrupt, every fourth carrier period. `missed` samples
  // before this one were never asked for.
  // Always inlined, so that the interrupt's own function takes it in: that lies in IRAM on the
  // chip.
  [[gnu::always_inline]] void sample(uint32_t missed) { synthesis_.player().sample(missed); }

  // A finger that a host or the console holds, until it lifts it or the host falls silent
  // (touch_input.hpp); the nearest place on the board, and how long the last touch has played or
  // did.
  Place touch(Place place, const void* host = nullptr, uint32_t finger = 0);
  void hear(const void* host) { input_.hear(host, now_us()); }
  // A host goes, and what it holds with it.
  void leave(const void* host) {
    if (input_.is_held_by(host)) lift();
  }
  void lift();
  void lift(uint32_t finger);
  // What a finger plays where the table has responses, from its next touch on.
  // Samples that wait for a signal are dropped.
  void set_voice(uint32_t finger, const VoiceSettings& settings) {
    touch_.set_voice(finger, settings);
    if (settings.has_signal && !has_bank_finger(finger)) signal(finger).begin();
  }
  // How far its signal may move a finger, 0.01 µm; false if the device does not know how far it
  // does.
  bool limit_signal(uint32_t finger, uint32_t most_10nm) {
    if (!table().has_responses() || config().full_force_mn == 0) return false;
    touch_.limit_signal(finger, most_10nm);
    return true;
  }
  // Its ring has the bank's samples, and takes none of a host's.
  bool has_bank_finger(uint32_t finger) const {
    return is_of_a_finger() && touch_.plays_bank(finger);
  }
  // Of a finger that plays one: samples wait here.
  SignalRing& signal(uint32_t finger) { return synthesis_.signal(finger); }
  // An effect of the bank, once, for a finger that is down and plays the bank's.
  bool play_effect(uint32_t finger, uint32_t effect, uint32_t level_q15);
  uint32_t played_ms() const { return played_.passed_ms(now_ms()); }
  // Of touches from now on.
  bool set_waveform(Waveform waveform) { return synthesis_.set_waveform(waveform); }
  TableStatus select_frequency(uint32_t frequency_millihertz);

  // A host drives the outputs, with frames of duties, half as many as samples (duty_ring.hpp) …
  bool stream_begin(uint32_t target = kStreamTarget);
  bool stream_push(const uint16_t* duties_q16);
  // … or with a drive that it must repeat within the touch timeout.
  bool play_live(const Drive& drive, uint32_t frequency_millihertz, Waveform waveform);
  void stream_end();

  // One coil plays, and the others are listened to (coil_sense.hpp). A finger ends it.
  link_format::Status sense(const SenseRequest& request);
  const CoilSense& coil_sense() const { return sense_; }

  // Flash may be written once outputs are off; false until then, so ask again. Touches and streams
  // are refused until `update_end`, which loads the table again.
  bool update_begin();
  void update_end();
  // An update of the table: begin is busy until outputs are off; a commit ends it, whatever comes
  // of it, and so does silence. `refused` says what is wrong with a header.
  link_format::Status table_begin(uint32_t total_bytes, uint32_t table_crc, const uint8_t* header,
                                  TableStatus& refused);
  link_format::Status table_data(uint32_t offset, const uint8_t* bytes, uint32_t count);
  link_format::Status table_commit();
  link_format::Status table_previous();
  uint32_t table_next() const { return table_.store().next_offset(); }
  // The same for the effect bank.
  link_format::Status bank_begin(uint32_t total_bytes, uint32_t bank_crc, const uint8_t* header,
                                 BankStatus& refused);
  link_format::Status bank_data(uint32_t offset, const uint8_t* bytes, uint32_t count);
  link_format::Status bank_commit();
  uint32_t bank_next() const { return bank_.store().next_offset(); }
  uint32_t slot() const { return table_.store().slot(); }
  // Kept for the next start. Only while `is_quiet` and `may_write`.
  ConfigStatus set_config(const uint8_t* record, uint32_t bytes, bool is_by_wire,
                          uint32_t allowed_driver);
  // The same for a record that `parse_network` takes, or none.
  bool set_network(const uint8_t* record, uint32_t size);
  bool is_quiet() const { return synthesis_.is_quiet(); }
  // Whether flash may be written once more, by any way that erases.
  bool may_write() const { return wear_.may_write(); }
  // Updates of flash, ever, each of which erases a sector once at most.
  uint32_t updates() const { return wear_.updates(); }
  // Sectors of flash, since power came on.
  uint32_t erases() const {
    return wear_.erases() + table_.store().erases() + bank_.store().erases();
  }
  // Outputs fade out, the answer gets its time on the way, and then everything starts again.
  void restart_soon();
  // What the last starts forbid this one (starts.hpp).
  bool may_start_network() { return starts_.may_start_network(faults_); }
  bool is_wire_only() const { return starts_.is_wire_only(); }
  bool is_bare() const { return starts_.is_bare(); }

  // Its way out; bytes to the host; a line for people.
  const Hal& hal() const { return hal_; }
  void send(const uint8_t* bytes, uint32_t count) const { hal_.send(hal_.context, bytes, count); }
  void print(const char* line) const { hal_.print(hal_.context, line); }

  DeviceState state() const { return state_; }
  const Config& config() const { return config_.in_force(); }
  ConfigStatus config_status() const { return config_.status(); }
  TableStatus table_status() const { return table_.status(); }
  const Table& table() const { return table_.table(); }
  const StoredBank& stored_bank() const { return bank_; }
  const AreaEvents& area_events() const { return effects_.events(); }
  uint32_t area_of(uint32_t finger) const { return effects_.area_of(finger); }
  const Synthesis& synthesis() const { return synthesis_; }
  const DutyRing& stream() const { return synthesis_.stream(); }
  const TouchInput& input() const { return input_; }
  const FingerDrives& finger_drives() const { return touch_.drives(); }
  const FaultLog& faults() const { return faults_; }
  const CoilHeat& heat() const { return heat_; }
  const SupplyMeter& supply() const { return supply_; }
  uint32_t now_ms() const { return clock_.now_ms(); }
  uint32_t awake_ms() const { return clock_.awake_ms(); }
  uint32_t stack_free() const { return hal_.stack_free(hal_.context); }

 private:
  uint32_t now_us() const { return hal_.now_us(hal_.context); }
  // The states.
  bool go(DeviceEvent event);
  void settle();
  bool is_of_a_finger() const {
    return state_ == DeviceState::kPlaying || state_ == DeviceState::kLifted;
  }
  // The faults.
  void note(FaultCause cause, uint32_t detail) { faults_.add(cause, detail, now_ms()); }
  void stand(FaultCause cause, uint32_t detail);
  void stand_supply();
  void clear_faults();
  void trust_host();
  // Where nothing plays, and nothing is left to be faded out.
  bool are_outputs_free() const { return !touch_.is_fading() && is_quiet(); }
  void silence();
  void start_outputs();
  uint32_t touch_timeout_us() const;
  uint32_t ramp_us() const;

  // Flash (device_flash.cpp).
  void load_config();
  void load_table();
  void load_bank();
  void load_again();
  bool open_update(SlotUpdates& updates);
  bool is_updated(const SlotUpdates& updates) const {
    return state_ == DeviceState::kUpdating && updated_ == &updates;
  }
  link_format::Status begin_update(SlotUpdates& updates, uint32_t total_bytes, uint32_t file_crc);
  link_format::Status write_update(SlotUpdates& updates, uint32_t offset, const uint8_t* bytes,
                                   uint32_t count);
  link_format::Status finish_update(link_format::Status status);
  void refuse_table();
  void check_config();
  void keep_retained(bool is_on);

  // In a turn.
  void watch_samples();
  void cut_outputs(uint32_t stopped_us);
  void watch_outputs();
  void watch_limits(uint32_t passed_ms);
  void handle(const TouchEvent& event);
  void advance_touch();
  void advance_host();
  void advance_sense();
  void watch_update();
  void watch_flash();
  void post_touch();

  void touch_down();
  void touch_up();
  bool let_effects_end();
  void end_touch();
  void break_touch();
  bool host_begins();
  void host_ends();

  Hal hal_{};
  DeviceState state_ = DeviceState::kIdle;
  FaultLog faults_;
  TurnClock clock_;
  Starts starts_;
  // In flash.
  StoredConfig config_;
  StoredTable table_;
  StoredBank bank_;
  SlotUpdates* updated_ = &table_.updates();  // or the bank's: by the update that is under way
  FlashWear wear_;
  // From the panel to the outputs.
  TouchInput input_;
  PanelWatch panel_watch_;
  TouchPlayback touch_;
  FingerEffects effects_;
  Stopwatch played_;  // by a finger
  HostDrive host_;
  CoilSense sense_;
  Synthesis synthesis_;
  OutputWatch output_watch_;
  CoilHeat heat_;
  SupplyMeter supply_;
  PinHeat known_heat_;
};

}  // namespace chladni
