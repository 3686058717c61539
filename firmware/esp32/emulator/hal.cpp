// The core's edges (core/hal.hpp) on a PC, each as strict as the hardware or stricter.
#include "core/sensing/expander.hpp"
#include "emulator/emulator.hpp"

namespace chladni::emulator {

namespace {

// Start, stop and an acknowledge per byte.
constexpr double kBitsPerByte = 9.0, kFrameBits = 2.0;

}  // namespace

Hal Emulator::hal() {
  Hal hal{};
  hal.context = this;
  hal.chip = from(this).hardware_.chip;
  hal.now_us = [](void* context) {
    const Emulator& self = from(context);
    return static_cast<uint32_t>(self.now_us() + self.hardware_.first_us);
  };
  hal.set_duties = [](void* context, int32_t* duties, uint32_t pins) {
    Emulator& self = from(context);
    const uint32_t channels = self.pwm_.channels();
    uint32_t signs = 0;
    for (uint32_t k = 0; k < channels; ++k) {
      signs |= ((pins >> (self.device_.config().sign_pins[k] & 31U)) & 1U) << k;
    }
    self.note(self.pwm_.write(self.period_, duties, signs, channels));
  };
  hal.stack_free = [](void*) -> uint32_t { return 0; };
  hal.cut_outputs = [](void* context) { from(context).pwm_.cut(); };
  hal.retained = [](void* context) { return from(context).retained_.data(); };
  hal.restart = [](void* context) { from(context).must_restart_ = true; };
  hal.reset_cause = [](void* context) { return from(context).reset_cause_; };
  add_bus(hal);
  add_flash(hal);
  add_host(hal);
  add_converter(hal);
  return hal;
}

void Emulator::add_bus(Hal& hal) {
  hal.i2c = [](void* context, uint8_t address, const uint8_t* written, uint32_t write_count,
               uint8_t* read, uint32_t read_count) {
    Emulator& self = from(context);
    const uint32_t bytes = 1 + write_count + (read_count > 0 ? 1 + read_count : 0);
    const double bits = kBitsPerByte * bytes + kFrameBits * (read_count > 0 ? 2 : 1);
    self.advance(bits * 1e3 / self.device_.config().i2c_khz);
    if (address == expander::kAddress && !self.panel_.is_stuck()) {
      return self.coils_.transfer(written, write_count);
    }
    if (self.accelerometer_.answers(address) && !self.panel_.is_stuck()) {
      return self.accelerometer_.transfer(written, write_count, read, read_count);
    }
    return self.panel_.transfer(address, written, write_count, read, read_count);
  };
  hal.recover_bus = [](void* context) {
    Emulator& self = from(context);
    self.advance(9.0 * 10.0);  // nine pulses at 100 kHz
    self.panel_.clock_free();
  };
  hal.panel_has_called = [](void* context) {
    Emulator& self = from(context);
    const bool has_called = self.has_called_;
    self.has_called_ = false;
    return has_called;
  };
}

void Emulator::add_converter(Hal& hal) {
  hal.start_listening = [](void* context) {
    Emulator& self = from(context);
    return self.coils_.start(self.period_, self.pwm_);
  };
  hal.heard = [](void* context, uint16_t* values, uint32_t most) {
    return from(context).coils_.heard(values, most);
  };
  hal.stop_listening = [](void* context) { from(context).coils_.stop(); };
}

void Emulator::add_flash(Hal& hal) {
  hal.read_flash = [](void* context, FlashArea area, uint32_t offset, uint8_t* bytes,
                      uint32_t count) {
    return from(context).area(area).read(offset, bytes, count);
  };
  hal.map_flash = [](void* context, FlashArea area, uint32_t offset,
                     uint32_t count) -> const uint8_t* {
    Emulator& self = from(context);
    if (area != FlashArea::kTables && area != FlashArea::kEffects) {
      self.note("only the flash of tables and effects is mapped");
      return nullptr;
    }
    const std::vector<uint8_t>& bytes = self.area(area).bytes();
    return offset > bytes.size() || count > bytes.size() - offset ? nullptr : bytes.data() + offset;
  };
  hal.erase_sector = [](void* context, FlashArea area, uint32_t offset) {
    Emulator& self = from(context);
    self.note(self.area(area).erase_sector(offset));
    self.advance(self.hardware_.erase_us);
    return true;
  };
  hal.program_flash = [](void* context, FlashArea area, uint32_t offset, const uint8_t* bytes,
                         uint32_t count) {
    Emulator& self = from(context);
    self.note(self.area(area).program(offset, bytes, count));
    self.advance(self.hardware_.program_us * count);
    return true;
  };
}

void Emulator::add_host(Hal& hal) {
  hal.send = [](void* context, const uint8_t* bytes, uint32_t count) {
    Emulator& self = from(context);
    self.put_on(self.from_device_, bytes, count);
  };
  hal.send_datagram = [](void* context, const uint8_t* bytes, uint32_t count) {
    Emulator& self = from(context);
    self.datagrams_out_.push_back({self.peer_, std::string(bytes, bytes + count)});
  };
  hal.print = [](void* context, const char* line) {
    Emulator& self = from(context);
    self.printed_.emplace_back(line);
    const std::string text = self.printed_.back() + "\r\n";
    self.put_on(self.from_device_, reinterpret_cast<const uint8_t*>(text.data()), text.size());
  };
  hal.hmac_sha256 = [](void* context, const uint8_t* key, const uint8_t* bytes, uint32_t count,
                       uint8_t* mac) {
    const Emulator& self = from(context);
    if (!self.hmac_) return false;
    const std::string made =
        self.hmac_(std::string(key, key + network_format::kKeyBytes), {bytes, bytes + count});
    for (size_t k = 0; k < 32; ++k) mac[k] = static_cast<uint8_t>(made.at(k));
    return true;
  };
  hal.random = [](void* context) {
    return static_cast<uint32_t>(from(context).random() * 4294967296.0);
  };
}

}  // namespace chladni::emulator
