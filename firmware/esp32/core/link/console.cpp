#include "core/link/console.hpp"

#include "core/base/text.hpp"

namespace chladni {

namespace {

constexpr const char* kHelp =
    "expected: touch X_UM Y_UM | lift | frequency MILLIHERTZ | waveform NAME | info | faults";

// Where answers go, and how many bytes of them went.
class Printer {
 public:
  explicit Printer(const Device& device) : device_(device) {}
  void print(const char* line) {
    device_.print(line);
    while (*line++ != '\0') ++bytes_;
    bytes_ += 2;  // the line's end
  }
  uint32_t bytes() const { return bytes_; }

 private:
  const Device& device_;
  uint32_t bytes_ = 0;
};

// What keeps a finger from being felt, and what else stands, a line each.
void print_standing(const Device& device, Printer& out) {
  for (uint32_t k = 0; k < kFaultCauses; ++k) {
    const auto cause = static_cast<FaultCause>(k);
    if (!device.faults().stands(cause)) continue;
    Line80 line;
    out.print(line.add("stands: ").add(to_text(cause)).text());
  }
}

void print_info(const Device& device, Printer& out) {
  out.print(to_text(device.state()));
  print_standing(device, out);
  out.print(to_text(device.table_status()));
  out.print(to_text(device.config_status()));
  out.print(to_text(device.input().health()));
  const CoilHeat& heat = device.heat();
  Line80 supply;
  out.print(supply.add(device.supply().mean_ma()).add(" mA").text());
  for (uint32_t k = 0; k < device.config().channels; ++k) {
    Line80 line;
    line.add("coil ").add(k).add(": ").add_milli(heat.rise_dk(k) * 100U).add(" K");
    out.print(line.text());
  }
}

void print_faults(const Device& device, Printer& out) {
  const FaultLog& faults = device.faults();
  if (faults.count() == 0) out.print("no faults");
  for (uint32_t k = 0; k < faults.kept(); ++k) {
    const Fault& fault = faults.at(k);
    Line80 line;
    line.add_milli(fault.at_ms).add(" s: ").add(to_text(fault.cause)).add(" (").add(fault.detail);
    out.print(line.add(")").text());
  }
}

// These return false if the words after the command make no sense.
bool touch(Device& device, Reader& words, Printer& out) {
  Place place{};
  if (!words.number(&place.x_um) || !words.number(&place.y_um) || !words.at_end()) return false;
  if (device.state() == DeviceState::kFault) {
    print_standing(device, out);
    return true;
  }
  device.touch(place);
  out.print("ok");
  return true;
}

bool select_frequency(Device& device, Reader& words, Printer& out) {
  int32_t millihertz = 0;
  if (!words.number(&millihertz) || !words.at_end() || millihertz <= 0) return false;
  if (!device.table().is_loaded()) {
    out.print(to_text(device.table_status()));
  } else if (device.state() != DeviceState::kIdle) {
    out.print("lift the finger first");
  } else {
    out.print(to_text(device.select_frequency(static_cast<uint32_t>(millihertz))));
  }
  return true;
}

bool set_waveform(Device& device, Reader& words, Printer& out) {
  for (uint32_t k = 0; k < kWaveforms; ++k) {
    if (!words.word(to_text(static_cast<Waveform>(k))) || !words.at_end()) continue;
    device.set_waveform(static_cast<Waveform>(k));
    out.print("ok");
    return true;
  }
  return false;
}

bool run(Device& device, const char* line, Printer& out) {
  Reader words(line);
  if (words.word("touch")) return touch(device, words, out);
  if (words.word("lift") && words.at_end()) {
    device.lift();
    out.print("ok");
    return true;
  }
  if (words.word("frequency")) return select_frequency(device, words, out);
  if (words.word("waveform")) return set_waveform(device, words, out);
  if (words.word("info") && words.at_end()) {
    print_info(device, out);
    return true;
  }
  if (words.word("faults") && words.at_end()) {
    print_faults(device, out);
    return true;
  }
  return false;
}

}  // namespace

uint32_t run_command(Device& device, const char* line) {
  Printer out(device);
  if (!run(device, line, out)) out.print(kHelp);
  return out.bytes();
}

}  // namespace chladni
