// The board on a PC: the firmware core on a virtual clock, with flash, PWM, a panel and fingers.
//
// Time is counted in carrier periods. The sample interrupt comes due in every fourth one, arrives
// after its latency and jitter, and its duties are latched together when the next period begins.
// The main loop turns once a millisecond and when the panel calls; a transfer on the bus, an erase
// or a programme takes its time, and samples go on meanwhile: they interrupt the main loop there.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "core/link/link.hpp"
#include "core/link/udp.hpp"
#include "core/synthesis/sample_clock.hpp"
#include "emulator/flash.hpp"
#include "emulator/mounted_accelerometer.hpp"
#include "emulator/panels.hpp"
#include "emulator/pwm.hpp"
#include "emulator/sensed_coils.hpp"

namespace chladni::emulator {

struct FingerEvent {
  uint64_t at_us;
  uint8_t finger;
  bool is_down;  // at the place, or lifted
  double x_mm;
  double y_mm;
};

struct Hardware {
  gpio::Chip chip = gpio::Chip::kEsp32;
  uint32_t table_sectors = 32;
  uint32_t bank_sectors = 32;  // 0: partitioned before there were effects
  PanelModel panel = PanelModel::kGt911;
  bool has_second_address = false;
  // From due to running: the sample interrupt's latency, and as much again at random.
  double interrupt_us = 2.0;
  double jitter_us = 0.0;
  double wake_us = 20.0;       // from the panel's call to the main loop
  double erase_us = 45000.0;   // of a sector
  double program_us = 2.5;     // per byte
  double restart_us = 300000;  // from a reset to the firmware
  double watchdog_us = 5e6;    // a main loop that hangs for so long is reset
  double baud = 0.0;           // of the console and link; 0 for the configuration's
  // After a power-on the coils are known to be cold, as after a rest that the device has seen; else
  // its memory of them is lost with the power.
  bool is_rested = true;
  // What the firmware's clocks begin with: microseconds wrap after 71.6 minutes, samples after 61
  // hours, milliseconds after 49.7 days.
  uint32_t first_us = 0;
  uint32_t first_ms = 0;
  uint32_t first_samples = 0;
  uint32_t seed = 1;
};

// A datagram and the peer it comes from or goes to; the emulator only hands the number back.
struct Datagram {
  uint32_t peer;
  std::string bytes;
};

// HMAC-SHA-256 of bytes under a key, of some library's.
using Hmac = std::function<std::string(const std::string& key, const std::string& bytes)>;

class Emulator {
 public:
  explicit Emulator(const Hardware& hardware);
  Emulator(const Emulator&) = delete;
  Emulator& operator=(const Emulator&) = delete;

  // Power on: RAM is lost, flash stays.
  void boot(ResetCause cause);
  // A reset: outputs low, and after a while the firmware starts again.
  void restart(ResetCause cause);
  // Advance the virtual clock. Stops at the first fault.
  void run_us(uint64_t microseconds);
  // Fingers by time, in ascending order and not before now.
  void add_finger(const FingerEvent& event) { fingers_.push_back(event); }
  // Stop the main loop (a hung task) while interrupts go on.
  void set_main_loop_hung(bool is_hung);
  // The next sample interrupt comes so late.
  void delay_next_sample(double microseconds) { extra_delay_us_ = microseconds; }
  // The sample interrupt comes no more, or again.
  void set_interrupt_dead(bool is_dead) { is_interrupt_dead_ = is_dead; }
  // The next sample interrupt fires twice.
  void repeat_next_sample() { must_repeat_ = true; }
  // Those channels, a bit each, have not taken their last duty when the next one comes.
  void drop_next_duties(uint32_t channels) { pwm_.make_deaf(channels); }
  void command(const std::string& line);
  gpio::Chip chip() const { return hardware_.chip; }
  // Bits per second of the link's wire, both ends of it.
  double baud() const { return hardware_.baud > 0.0 ? hardware_.baud : device_.config().link_baud; }
  // The wire of the link: bytes on their way to the device, one after another; and what has come
  // from it by now.
  void uart_write(const std::string& bytes);
  std::string uart_read();
  // Datagrams to the device, taken at the main loop's next turn; and what it has sent.
  void udp_write(const Datagram& datagram) { datagrams_in_.push_back(datagram); }
  std::vector<Datagram> udp_read();
  // Without it the device makes no MAC, and stays off the network.
  void set_hmac(Hmac hmac) { hmac_ = std::move(hmac); }
  // Let the firmware keep a configuration.
  ConfigStatus save(const Config& config) {
    return holds_config(hal(), config) ? ConfigStatus::kOk : save_config(hal(), config);
  }

  Flash& tables() { return tables_; }
  Flash& config() { return config_; }
  Flash& network() { return network_; }
  Flash& boots() { return boots_; }
  Flash& effects() { return effects_; }
  Pwm& pwm() { return pwm_; }
  Panel& panel() { return panel_; }
  SensedCoils& coils() { return coils_; }
  MountedAccelerometer& accelerometer() { return accelerometer_; }
  Device& device() { return device_; }
  const NetworkState& network_state() const { return datagrams_.state(); }
  const Device& device() const { return device_; }
  uint64_t now_us() const { return static_cast<uint64_t>(now_ns() / 1000U); }
  uint64_t period() const { return period_; }
  // When the panel's line fell, carrier periods.
  const std::vector<uint64_t>& calls() const { return calls_; }
  // What the firmware did that hardware would not forgive; empty while all is well.
  const std::string& fault() const { return fault_; }
  const std::vector<std::string>& printed() const { return printed_; }

 private:
  static Emulator& from(void* context) { return *static_cast<Emulator*>(context); }
  // 12.5 ns to a step of the carrier.
  uint64_t now_ns() const {
    return begun_ns_ + ((period_ - begun_period_) << pwm_.bits()) * 25U / 2U;
  }
  uint64_t in_periods(double microseconds) const;
  // The core's edges (hal.cpp).
  Hal hal();
  static void add_bus(Hal& hal);
  static void add_flash(Hal& hal);
  static void add_host(Hal& hal);
  static void add_converter(Hal& hal);
  void advance_period();
  void advance(double microseconds);
  void interrupt();
  void sample_if_due();
  void scan_if_due();
  void move_fingers();
  void turn_main_loop();
  void receive();
  void receive_datagrams();
  Flash& area(FlashArea area);
  double random();
  void lose_memory();
  void note(const std::string& fault) {
    if (fault_.empty()) fault_ = fault;
  }

  Hardware hardware_;
  std::array<uint8_t, kRetainedBytes> retained_{};
  Flash tables_;
  Flash config_;
  Flash network_;
  Flash boots_;
  Flash effects_;
  Pwm pwm_{1, 10};
  Panel panel_;
  SensedCoils coils_;
  MountedAccelerometer accelerometer_;
  Device device_;
  Datagrams datagrams_{device_};
  Link link_{device_, datagrams_.state()};
  Hmac hmac_;
  bool is_booted_ = false;
  ResetCause reset_cause_ = ResetCause::kPowerOn;
  uint64_t period_ = 0;
  // The carrier may change at a boot: where its periods are counted from.
  uint64_t begun_period_ = 0;
  uint64_t begun_ns_ = 0;
  uint64_t sample_due_ = 0;  // carrier periods
  SampleClock sample_clock_;
  bool is_interrupt_dead_ = false;
  bool must_repeat_ = false;
  uint64_t sample_at_ = 0;
  double extra_delay_us_ = 0.0;
  uint64_t run_until_us_ = 0;
  uint64_t next_turn_us_ = 0;
  uint64_t wake_at_us_ = UINT64_MAX;
  uint64_t next_scan_us_ = 0;
  bool has_called_ = false;
  bool is_main_loop_hung_ = false;
  uint64_t hung_since_us_ = 0;
  std::vector<FingerEvent> fingers_;
  size_t next_finger_ = 0;
  std::vector<PanelFinger> down_;
  std::vector<uint64_t> calls_;
  struct WireByte {
    double at_us;
    uint8_t byte;
  };
  using Wire = std::deque<WireByte>;
  void put_on(Wire& wire, const uint8_t* bytes, size_t count) const;
  Wire to_device_;
  Wire from_device_;
  std::deque<Datagram> datagrams_in_;
  std::vector<Datagram> datagrams_out_;
  uint32_t peer_ = 0;  // of the datagram that is being handled
  bool must_restart_ = false;
  uint32_t random_;
  std::string fault_;
  std::vector<std::string> printed_;
};

}  // namespace chladni::emulator
