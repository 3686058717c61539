#include "emulator/emulator.hpp"

#include <new>

#include "core/link/console.hpp"
#include "core/storage/retained.hpp"

namespace chladni::emulator {

namespace {

constexpr uint64_t kTurnUs = 1000;
constexpr uint32_t kConfigSectors = 2, kNetworkSectors = 1, kBootSectors = 1;
constexpr uint32_t kLoopback = 0x0100007F;  // 127.0.0.1
constexpr size_t kReceiveBytes = 4096;      // as chip/link/console.cpp
constexpr uint64_t kRunSlackUs = 100;       // more than a carrier period
constexpr uint32_t kCyclesPerStep = 3;      // 240 MHz by 80

}  // namespace

Emulator::Emulator(const Hardware& hardware)
    : hardware_(hardware),
      tables_(hardware.table_sectors),
      config_(kConfigSectors),
      network_(kNetworkSectors),
      boots_(kBootSectors),
      effects_(hardware.bank_sectors),
      random_(hardware.seed * 2654435761U + 1U) {}

uint64_t Emulator::in_periods(double microseconds) const {
  return static_cast<uint64_t>(microseconds * 80.0) >> pwm_.bits();
}

// From 0 to 1 (xorshift; only ever for jitter).
double Emulator::random() {
  random_ ^= random_ << 13;
  random_ ^= random_ >> 17;
  random_ ^= random_ << 5;
  return static_cast<double>(random_) / 4294967296.0;
}

// Of a power-on, or of anything that takes the power with it.
void Emulator::lose_memory() {
  if (hardware_.is_rested) {
    keep(hal(), {});
    return;
  }
  for (uint8_t& byte : retained_) byte = static_cast<uint8_t>(256.0 * random());
}

void Emulator::boot(ResetCause cause) {
  reset_cause_ = cause;
  if (cause == ResetCause::kPowerOn) lose_memory();
  has_called_ = false;
  wake_at_us_ = UINT64_MAX;
  is_main_loop_hung_ = false;
  // The device holds atomics and cannot be assigned; starting means making it again in place.
  device_.~Device();
  new (&device_) Device();
  link_.~Link();
  datagrams_.~Datagrams();
  new (&datagrams_) Datagrams(device_);
  new (&link_) Link(device_, datagrams_.state());
  to_device_.clear();
  datagrams_in_.clear();
  must_restart_ = false;
  is_booted_ = false;  // no samples before the outputs are set up
  pwm_.reset();
  device_.start(hal(), {hardware_.first_ms, hardware_.first_samples});
  datagrams_.start();
  if (datagrams_.state().is_on) datagrams_.set_address(kLoopback);
  const Config& config = device_.config();
  const bool has_signs = config.driver == kBridge;
  if (config.channels != pwm_.channels() || config.pwm_bits != pwm_.bits() ||
      has_signs != pwm_.has_signs()) {
    begun_ns_ = now_ns();
    begun_period_ = period_;
    pwm_ = Pwm(config.channels, config.pwm_bits, has_signs);
  }
  pwm_.reset();
  coils_.stop();
  panel_.mount(config.panel == 0 ? PanelModel::kNone : hardware_.panel, config,
               hardware_.has_second_address);
  is_booted_ = true;
  sample_due_ = (period_ + kCarrierPeriodsPerSample - 1) / kCarrierPeriodsPerSample *
                kCarrierPeriodsPerSample;
  sample_at_ = sample_due_ + in_periods(hardware_.interrupt_us);
  const uint32_t cycles_per_period = kCyclesPerStep << pwm_.bits();
  sample_clock_.start(cycles_per_period * kCarrierPeriodsPerSample,
                      static_cast<uint32_t>(sample_due_) * cycles_per_period);
  next_turn_us_ = now_us();
  next_scan_us_ = now_us() + panel_.period_us(false);
  run_command(device_, "info");  // as chip/app_main.cpp greets
}

void Emulator::restart(ResetCause cause) {
  is_booted_ = false;
  pwm_.reset();
  advance(hardware_.restart_us);
  const PanelFaults faults = panel_.faults();
  boot(cause);
  panel_.faults() = faults;
}

void Emulator::set_main_loop_hung(bool is_hung) {
  is_main_loop_hung_ = is_hung;
  hung_since_us_ = now_us();
}

void Emulator::command(const std::string& line) {
  if (is_booted_) {
    run_command(device_, line.c_str());
  } else {
    note("the board is not powered on");
  }
}

void Emulator::advance_period() {
  pwm_.begin_period();
  coils_.begin_period(period_, pwm_);
  accelerometer_.begin_period(now_ns(), coils_);
  if (is_booted_) sample_if_due();
  scan_if_due();
  ++period_;
}

// Time passes under the main loop.
void Emulator::advance(double microseconds) {
  const uint64_t periods = in_periods(microseconds) + 1U;
  for (uint64_t k = 0; k < periods && fault_.empty(); ++k) advance_period();
}

// As chip/outputs/sample_timer.cpp, whose cycle counter runs three times as fast as the LEDC.
void Emulator::interrupt() {
  const auto now = static_cast<uint32_t>((period_ << pwm_.bits()) * kCyclesPerStep);
  uint32_t missed = 0;
  if (sample_clock_.tick(now, missed)) device_.sample(missed);
}

void Emulator::sample_if_due() {
  if (is_interrupt_dead_ || period_ < sample_at_) return;
  // Interrupts that came due meanwhile are one.
  const uint64_t late = (period_ - sample_due_) / kCarrierPeriodsPerSample;
  interrupt();
  if (must_repeat_) interrupt();
  must_repeat_ = false;
  sample_due_ += (late + 1U) * kCarrierPeriodsPerSample;
  const double delay = hardware_.interrupt_us + hardware_.jitter_us * random() + extra_delay_us_;
  extra_delay_us_ = 0.0;
  sample_at_ = sample_due_ + in_periods(delay);
}

void Emulator::move_fingers() {
  const uint64_t now = now_us();
  while (next_finger_ < fingers_.size() && fingers_[next_finger_].at_us <= now) {
    const FingerEvent& event = fingers_[next_finger_++];
    size_t k = 0;
    while (k < down_.size() && down_[k].id != event.finger) ++k;
    const auto at = down_.begin() + static_cast<std::ptrdiff_t>(k);
    if (!event.is_down) {
      if (k < down_.size()) down_.erase(at);
    } else if (k < down_.size()) {
      *at = {event.finger, event.x_mm, event.y_mm};
    } else {
      down_.push_back({event.finger, event.x_mm, event.y_mm});
    }
  }
}

void Emulator::scan_if_due() {
  const uint64_t now = now_us();
  if (now < next_scan_us_) return;
  move_fingers();
  next_scan_us_ += panel_.period_us(!down_.empty());
  if (!panel_.scan(down_)) return;
  has_called_ = device_.config().interrupt_pin != 255;
  calls_.push_back(period_);
  const uint64_t wake = now + static_cast<uint64_t>(hardware_.wake_us);
  if (has_called_ && wake < wake_at_us_) wake_at_us_ = wake;
}

void Emulator::turn_main_loop() {
  const uint64_t now = now_us();
  if (now < next_turn_us_ && now < wake_at_us_) return;
  if (now >= wake_at_us_) wake_at_us_ = UINT64_MAX;
  while (next_turn_us_ <= now) next_turn_us_ += kTurnUs;
  if (!is_main_loop_hung_) {
    receive();
    receive_datagrams();
    device_.poll();
    if (must_restart_) restart(ResetCause::kSoftware);
  } else if (static_cast<double>(now - hung_since_us_) >= hardware_.watchdog_us) {
    restart(ResetCause::kWatchdog);
  }
}

// One byte after another, behind those that are still on their way.
void Emulator::put_on(Wire& wire, const uint8_t* bytes, size_t count) const {
  const double per_byte_us = 10e6 / baud();
  double at_us = static_cast<double>(now_us());
  if (!wire.empty() && wire.back().at_us > at_us) at_us = wire.back().at_us;
  for (size_t k = 0; k < count; ++k) {
    at_us += per_byte_us;
    wire.push_back({at_us, bytes[k]});
  }
}

void Emulator::uart_write(const std::string& bytes) {
  put_on(to_device_, reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size());
}

std::string Emulator::uart_read() {
  std::string bytes;
  const auto now = static_cast<double>(now_us());
  while (!from_device_.empty() && from_device_.front().at_us <= now) {
    bytes.push_back(static_cast<char>(from_device_.front().byte));
    from_device_.pop_front();
  }
  return bytes;
}

// What has arrived since the last turn; more than the driver's buffer holds is lost.
void Emulator::receive() {
  const auto now = static_cast<double>(now_us());
  std::vector<uint8_t> arrived;
  while (!to_device_.empty() && to_device_.front().at_us <= now) {
    if (arrived.size() < kReceiveBytes) arrived.push_back(to_device_.front().byte);
    to_device_.pop_front();
  }
  if (!arrived.empty()) link_.receive(arrived.data(), static_cast<uint32_t>(arrived.size()));
}

void Emulator::receive_datagrams() {
  datagrams_.poll();
  while (!datagrams_in_.empty()) {
    const Datagram datagram = datagrams_in_.front();
    datagrams_in_.pop_front();
    peer_ = datagram.peer;
    datagrams_.receive(reinterpret_cast<const uint8_t*>(datagram.bytes.data()),
                       static_cast<uint32_t>(datagram.bytes.size()), datagram.peer);
  }
}

std::vector<Datagram> Emulator::udp_read() {
  std::vector<Datagram> sent;
  sent.swap(datagrams_out_);
  return sent;
}

Flash& Emulator::area(FlashArea area) {
  switch (area) {
    case FlashArea::kTables: return tables_;
    case FlashArea::kConfig: return config_;
    case FlashArea::kBoots: return boots_;
    case FlashArea::kEffects: return effects_;
    case FlashArea::kNetwork: break;
  }
  return network_;
}

void Emulator::run_us(uint64_t microseconds) {
  if (!is_booted_) note("the board is not powered on");
  // From where the last run should have ended: many short runs take as long as one.
  const uint64_t now = now_us();
  if (now > run_until_us_ + kRunSlackUs) run_until_us_ = now;
  run_until_us_ += microseconds;
  while (now_us() < run_until_us_ && fault_.empty()) {
    advance_period();
    turn_main_loop();
  }
}

}  // namespace chladni::emulator
