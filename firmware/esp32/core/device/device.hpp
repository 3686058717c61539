// The device: a touch becomes a drive, and every way a touch can end turns the outputs off.
#pragma once

#include <cstdint>

#include "core/base/fault_log.hpp"
#include "core/device/coil_heat.hpp"
#include "core/device/output_watch.hpp"
#include "core/device/starts.hpp"
#include "core/device/state.hpp"
#include "core/device/touch_playback.hpp"
#include "core/device/turn_clock.hpp"
#include "core/generated/link_format.hpp"
#include "core/hal.hpp"
#include "core/storage/network_record.hpp"
#include "core/storage/retained.hpp"
#include "core/storage/stored_config.hpp"
#include "core/storage/stored_table.hpp"
#include "core/synthesis/synthesis.hpp"
#include "core/table/table.hpp"
#include "core/touch/panel_watch.hpp"
#include "core/touch/touch_input.hpp"

namespace chladni {

// While no table says otherwise.
constexpr uint32_t kDefaultFrequencyMillihertz = 160000;
constexpr uint32_t kDefaultRampUs = 4000;
constexpr uint32_t kDefaultTimeoutUs = 100000;
constexpr uint32_t kDefaultMaxOnUs = 10000000;

// How a host drives the outputs.
enum class HostDrive : uint8_t {
  kNone,
  kClearing,  // frames are to come; the ring is emptied once the interrupt reads it no more
  kFilling,   // until there are enough to begin, or to begin again
  kRunning,
  kWaves,  // a drive, with a frequency and a wave of the host's
};

class Device {
 public:
  // Load configuration and table and get ready; outputs stay off.
  void start(const Hal& hal);
  // One turn of the main loop; call it every millisecond, and as soon as the panel calls.
  void poll();
  // One sample; call it from the sample interrupt, every fourth carrier period. `missed` samples
  // before this one were never asked for.
  // Always inlined, so that the interrupt's own function takes it in: that lies in IRAM on the
  // chip.
  [[gnu::always_inline]] void sample(uint32_t missed) { synthesis_.sample(hal_, missed); }

  // A host drives the outputs, with frames of duties, half as many as samples (duty_ring.hpp) …
  bool stream_begin(uint32_t target = kStreamTarget);
  bool stream_push(const uint16_t* duties_q16);
  // … or with a drive that it must repeat within the touch timeout.
  bool play_live(const Drive& drive, uint32_t frequency_millihertz, Waveform waveform);
  void stream_end();

  // Flash may be written once outputs are off; false until then, so ask again. Touches and streams
  // are refused until `update_end`, which loads the table again.
  bool update_begin();
  void update_end();
  // An update of the table: begin is busy until outputs are off; a commit ends it, whatever comes
  // of it, and so does silence.
  // What would be refused by its header is refused before anything is erased.
  link_format::Status table_begin(uint32_t total_bytes, uint32_t table_crc, const uint8_t* header,
                                  TableStatus& refused);
  link_format::Status table_data(uint32_t offset, const uint8_t* bytes, uint32_t count);
  link_format::Status table_commit();
  link_format::Status table_previous();
  uint32_t table_next() const { return table_.store().next_offset(); }
  uint32_t slot() const { return table_.store().slot(); }
  // Sectors of flash, since power came on.
  uint32_t erases() const { return wear_.erases() + table_.store().erases(); }

  // A finger that the host or the console holds, until it lifts it; the nearest place on the board,
  // and how long the last touch has played or did.
  Place touch(Place place);
  void lift();
  uint32_t played_ms() const { return played_.passed_ms(now_ms()); }
  // Kept for the next start. Only while `is_quiet`: flash is written.
  bool is_quiet() const { return synthesis_.is_quiet(); }
  ConfigStatus set_config(const uint8_t* record, uint32_t bytes, bool is_by_wire);
  // The same for a record that `parse_network` takes, or none.
  bool set_network(const uint8_t* record, uint32_t size);
  // Whether flash may be written once more this hour.
  bool may_write() const { return wear_.may_write(); }
  // Outputs fade out, the answer gets its time on the way, and then everything starts again.
  void restart_soon();
  void send(const uint8_t* bytes, uint32_t count) const { hal_.send(hal_.context, bytes, count); }
  // One line for people.
  void print(const char* line) const { hal_.print(hal_.context, line); }
  uint32_t stack_free() const { return hal_.stack_free(hal_.context); }
  uint32_t now_ms() const { return clock_.now_ms(); }
  uint32_t awake_ms() const { return clock_.awake_ms(); }

  // Of touches from now on.
  bool set_waveform(Waveform waveform);
  TableStatus select_frequency(uint32_t frequency_millihertz);

  DeviceState state() const { return state_; }
  const Config& config() const { return config_.in_force(); }
  ConfigStatus config_status() const { return config_.status(); }
  TableStatus table_status() const { return table_.status(); }
  const Table& table() const { return table_.table(); }
  const Synthesis& synthesis() const { return synthesis_; }
  const DutyRing& stream() const { return synthesis_.stream(); }
  const TouchInput& input() const { return input_; }
  const FaultLog& faults() const { return faults_; }
  const CoilHeat& heat() const { return heat_; }

 private:
  bool go(DeviceEvent event);
  void load_table();
  void load_again();
  void start_outputs();
  SynthesisSettings synthesis_settings() const;
  void note(FaultCause cause, uint32_t detail);
  void stand(FaultCause cause, uint32_t detail);
  void settle();

  void watch_samples(uint32_t now_us);
  void watch_outputs();
  void watch_coils(uint32_t passed_ms);
  void clear_faults();
  void handle(const TouchEvent& event, uint32_t now_us);
  void touch_down(Place place, uint32_t now_us);
  void touch_up(uint32_t now_us);
  void end_touch();
  void silence();
  void advance_touch(uint32_t now_us);
  void trust_host();
  void host_is_heard();
  void forget_host();
  void advance_stream();
  void watch_update();
  void watch_flash();
  void check_config();
  void keep_retained(bool is_on) const;
  void refuse_table();
  void post_touch();
  bool is_of_a_finger() const {
    return state_ == DeviceState::kPlaying || state_ == DeviceState::kLifted;
  }
  // Where nothing plays, and nothing is left to be faded out.
  bool are_outputs_free() const { return !touch_.is_fading() && is_quiet(); }

  Hal hal_{};
  StoredConfig config_;
  StoredTable table_;
  FlashWear wear_;
  DeviceState state_ = DeviceState::kIdle;
  TouchInput input_;
  FaultLog faults_;
  CoilHeat heat_;
  TouchPlayback touch_;
  Stopwatch played_;  // by a finger
  PanelWatch panel_watch_;
  OutputWatch output_watch_;
  TurnClock clock_;
  Starts starts_;

  // A host that drives the outputs, and when it was last heard.
  HostDrive host_drive_ = HostDrive::kNone;
  uint32_t host_us_ = 0;
  uint32_t stream_target_ = kStreamTarget;
  Synthesis synthesis_;
};

}  // namespace chladni
