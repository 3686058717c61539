// The core on another processor: takes a table, looks places up, plays two seconds of touches with
// switches and two with bridges, and says how many instructions that took and what came out, for
// tools/instruction_counts.py.
#include <cstdint>

#include "core/base/crc32.hpp"
#include "core/device/device.hpp"
#include "core/link/console.hpp"
#include "core/link/link.hpp"
#include "core/link/udp.hpp"
#include "core/storage/retained.hpp"
#include "qemu/runtime.hpp"
#include "qemu/voices.hpp"

extern "C" {
extern const uint8_t table_begin[];
extern const uint8_t table_end[];
#ifdef __XTENSA__
// The lx106 has no division; the ESP32's LX6 divides in hardware, and only while a table is loaded.
uint32_t __udivsi3(uint32_t dividend, uint32_t divisor) {
  uint32_t quotient = 0, rest = 0;
  for (int bit = 31; bit >= 0; --bit) {
    rest = (rest << 1) | ((dividend >> bit) & 1U);
    if (rest >= divisor) {
      rest -= divisor;
      quotient |= 1U << bit;
    }
  }
  return quotient;
}
uint32_t __umodsi3(uint32_t dividend, uint32_t divisor) {
  return dividend - __udivsi3(dividend, divisor) * divisor;
}
int32_t __divsi3(int32_t dividend, int32_t divisor) {
  const auto size = [](int32_t value) {
    return value < 0 ? 0U - static_cast<uint32_t>(value) : static_cast<uint32_t>(value);
  };
  const auto quotient = static_cast<int32_t>(__udivsi3(size(dividend), size(divisor)));
  return (dividend < 0) == (divisor < 0) ? quotient : -quotient;
}
#endif
}

namespace {

constexpr uint32_t kPlaces = 4000;

uint8_t retained_bytes[chladni::kRetainedBytes];
uint8_t config_record[chladni::config_format::kRecordBytes];

bool read_flash(void*, chladni::FlashArea area, uint32_t offset, uint8_t* bytes, uint32_t count) {
  if (area == chladni::FlashArea::kBoots) return false;  // nothing is programmed here
  // The defaults with pins, written down: a device that was never configured plays nothing.
  const bool is_config = area == chladni::FlashArea::kConfig;
  for (uint32_t k = 0; k < count; ++k) {
    const uint32_t at = offset + k;
    bytes[k] = is_config && at < sizeof config_record ? config_record[at] : 0xFF;
  }
  return true;
}

const uint8_t* map_flash(void*, chladni::FlashArea area, uint32_t offset, uint32_t count) {
  if (area != chladni::FlashArea::kTables) return nullptr;
  const auto size = static_cast<uint32_t>(table_end - table_begin);
  return offset > size || count > size - offset ? nullptr : table_begin + offset;
}

#if defined(LOOKUPS_ONLY)
constexpr bool kPlays = false, kPlaysVoices = false;
#elif defined(VOICES_ONLY)
constexpr bool kPlays = false, kPlaysVoices = true;
#else
constexpr bool kPlays = CHANNELS == 5U, kPlaysVoices = true;
#endif

chladni::Table table;
chladni::Device switches, bridges;

struct Counts {
  uint32_t most = 0, sum = 0, number = 0;
  void add(uint32_t count) {
    if (count > most) most = count;
    sum += count;
    ++number;
  }
};

// Two seconds on the virtual clock: half a second of each waveform, a touch that moves every 100
// ms.
class Scenario {
 public:
  static constexpr uint32_t kSamplesPerWave = 9766;  // 19,531 per second
  static constexpr uint32_t kSamplesPerMove = 1953, kSamplesPerTurn = 20;
  static constexpr uint32_t kSettled = 200;

  constexpr explicit Scenario(chladni::Device& device) : device_(device) {}

  void run(uint32_t overhead, bool has_bridges) {
    overhead_ = overhead;
    has_bridges_ = has_bridges;
    chladni::Hal hal{};
    hal.context = this;
    hal.now_us = [](void* context) { return static_cast<Scenario*>(context)->now_us_; };
    hal.set_duties = [](void* context, int32_t* duties, uint32_t signs) {
      auto& own = *static_cast<Scenario*>(context);
      own.duties_ = duties;
      own.signs_ = signs;
    };
    hal.stack_free = [](void*) -> uint32_t { return 0; };
    hal.cut_outputs = [](void*) {};
    hal.retained = [](void*) -> uint8_t* { return retained_bytes; };
    chladni::keep(hal, {});  // cold coils
    hal.read_flash = read_flash;
    hal.map_flash = map_flash;
    hal.reset_cause = [](void*) { return chladni::ResetCause::kPowerOn; };
    hal.send = [](void*, const uint8_t*, uint32_t) {};
    hal.print = [](void*, const char*) {};
    chladni::Config config{};
    config.pwm_pins = {4, 5, 12, 13, 14};  // any gates will do
    if (has_bridges) {
      config.driver = chladni::kBridge;
      config.sign_pins = {18, 19, 23, 25, 26};
      config.lost_ns = 40;
    }
    chladni::write_record(config, 1, config_record);
    device_.start(hal);
    for (uint32_t wave = 0; wave < chladni::kWaveforms; ++wave) {
      device_.set_waveform(static_cast<chladni::Waveform>(wave));
      if (wave == 0) {
        play(sine_steady, sine_ramping, sine_turning);
      } else {
        play(others_steady, others_ramping, others_turning);
      }
    }
  }

  uint32_t crc() const { return crc_ ^ 0xFFFFFFFFU; }

  Counts sine_steady, sine_ramping, others_steady, others_ramping, with_news;
  // With bridges, of samples in which a coil's current turns or is 0.
  Counts sine_turning, others_turning;
  Counts sine;  // steady ones and turning ones
  Counts turn;  // of the main loop, of those without a command

 private:
  void play(Counts& steady, Counts& ramping, Counts& turning) {
    for (uint32_t sample = 0; sample < kSamplesPerWave; ++sample) {
      const uint32_t since_move = sample % kSamplesPerMove;
      // The last move of a wave is a lift-up.
      const bool is_last = sample / kSamplesPerMove == kSamplesPerWave / kSamplesPerMove - 1U;
      if (since_move == 0)
        run_command(device_, is_last ? "lift" : kMoves[sample / kSamplesPerMove % 4]);
      if (sample % kSamplesPerTurn == 0) {
        now_us_ += 1024;
        const uint32_t turned = counter();
        device_.poll();
        if (since_move != 0) turn.add(counter() - turned - overhead_);
      }
      const uint32_t signs_before = signs_;
      const uint32_t begin = counter();
      device_.sample(0);
      const uint32_t count = counter() - begin - overhead_;
      uint8_t bytes[2 * CHANNELS + 4];
      uint32_t all = 0;
      bool does_turn = signs_ != signs_before;
      for (uint32_t k = 0; k < CHANNELS; ++k) {
        all |= static_cast<uint32_t>(duties_[k]);
        does_turn |= duties_[k] == 0;
        bytes[2 * k] = static_cast<uint8_t>(duties_[k]);
        bytes[2 * k + 1] = static_cast<uint8_t>(duties_[k] >> 8);
      }
      for (uint32_t k = 0; k < 4; ++k) {
        bytes[2 * CHANNELS + k] = static_cast<uint8_t>(signs_ >> (8 * k));
      }
      // What the main loop has for the interrupt is taken by the sample after its turn.
      const bool is_steady = since_move >= kSettled && !is_last;
      const bool has_news = sample % kSamplesPerTurn == 0;
      if (has_news) {
        with_news.add(count);
      } else if (has_bridges_ && does_turn && all != 0) {
        turning.add(count);
      } else if (is_steady) {
        steady.add(count);
      } else if (all != 0) {
        ramping.add(count);
      }
      if (!has_news && is_steady && &steady == &sine_steady) sine.add(count);
      crc_ = chladni::crc32_feed(crc_, bytes, sizeof bytes);
    }
  }

  static constexpr const char* kMoves[4] = {"touch 0 0", "touch 20000 40000", "touch -20000 50000",
                                            "touch 5000 -60000"};
  chladni::Device& device_;
  uint32_t overhead_ = 0;
  uint32_t now_us_ = 0;
  const int32_t* duties_ = nullptr;  // the core's own, until the next sample
  uint32_t signs_ = 0;
  bool has_bridges_ = false;
  uint32_t crc_ = chladni::kCrc32Start;
};

Scenario with_switches(switches), with_bridges(bridges);

void say_counts(const Scenario& scenario, const char* begins) {
  say("sine_steady", scenario.sine_steady.most, begins);
  say("sine_ramping", scenario.sine_ramping.most, begins);
  say("others_steady", scenario.others_steady.most, begins);
  say("others_ramping", scenario.others_ramping.most, begins);
  say("with_news", scenario.with_news.most, begins);
  say("sine_turning", scenario.sine_turning.most, begins);
  say("sine_sum", scenario.sine.sum, begins);
  say("sine_samples", scenario.sine.number, begins);
  say("others_turning", scenario.others_turning.most, begins);
  say("turn", scenario.turn.most, begins);
  say("duties_crc", scenario.crc(), begins);
}

chladni::qemu::VoicesScenario voices;

void play_voices(uint32_t overhead) {
  voices.run(overhead);
  static constexpr const char* kParts[] = {"1", "2", "3", "4", "5", "signal"};
  for (uint32_t k = 0; k < voices.kParts; ++k) say(kParts[k], voices.steady[k], "voices_");
  say("ramping", voices.ramping, "voices_");
  say("with_news", voices.with_news, "voices_");
  say("voices_duties_crc", voices.crc());
}

// What the core keeps in RAM: it has no other variables.
void say_ram() {
  using namespace chladni;
  say("ram_stream_ring", sizeof(DutyRing));
  say("ram_synthesis", sizeof(Synthesis) - sizeof(DutyRing));
  say("ram_table", sizeof(Table));
  say("ram_finger_drives", sizeof(FingerDrives));
  say("ram_rest_of_device",
      sizeof(Device) - sizeof(Synthesis) - sizeof(Table) - sizeof(FingerDrives));
  say("ram_link", sizeof(Link));
  say("ram_datagrams", sizeof(Datagrams));
}

}  // namespace

int main() {
  chladni::Hal hal{};
  hal.map_flash = map_flash;
  const uint32_t nothing = counter();
  const uint32_t overhead = counter() - nothing;
  uint32_t begin = counter();
  const chladni::TableStatus status = table.load(hal, CHANNELS);
  say("load", counter() - begin - overhead);
  say("status", static_cast<uint32_t>(status));
  // The same places as tools/instruction_counts.py: a linear congruential sequence.
  uint32_t seed = 1, most = 0, sum = 0, crc = chladni::kCrc32Start;
  chladni::Drive drive{};
  for (uint32_t k = 0; k < kPlaces; ++k) {
    seed = seed * 1664525U + 1013904223U;
    const auto x_um = static_cast<int32_t>(seed >> 16) - 32768;
    seed = seed * 1664525U + 1013904223U;
    const auto y_um = static_cast<int32_t>(seed >> 15) - 65536;
    begin = counter();
    table.drive_at({x_um, y_um}, drive);
    const uint32_t taken = counter() - begin - overhead;
    sum += taken;
    if (taken > most) most = taken;
    for (uint32_t channel = 0; channel < CHANNELS; ++channel) {
      const auto i = static_cast<uint16_t>(drive[channel].in_phase_q15);
      const auto q = static_cast<uint16_t>(drive[channel].quadrature_q15);
      const uint8_t bytes[4] = {static_cast<uint8_t>(i), static_cast<uint8_t>(i >> 8),
                                static_cast<uint8_t>(q), static_cast<uint8_t>(q >> 8)};
      crc = chladni::crc32_feed(crc, bytes, 4);
    }
  }
  say("lookup_most", most);
  say("lookup_sum", sum);
  say("lookups", kPlaces);
  say_ram();
  say("drives_crc", crc ^ 0xFFFFFFFFU);
  if (kPlaysVoices) play_voices(overhead);
  // The authors' board has five channels; for other tables there is nothing to play.
  if (!kPlays) return 0;
  with_switches.run(overhead, false);
  say_counts(with_switches, "");
  with_bridges.run(overhead, true);
  say_counts(with_bridges, "bridge_");
  return 0;
}
