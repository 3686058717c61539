"""A stream may last a day: the interrupt's own half, given the samples of a day at once."""

from __future__ import annotations

import subprocess
from pathlib import Path

from conftest import ROOT

CORE = ROOT / "firmware" / "esp32"
PROGRAM = r"""
#include <cstdio>
#include "core/synthesis/sample_player.hpp"
using namespace chladni;
SamplePlayer player;
int main() {
  Hal hal{};
  hal.set_duties = [](void*, int32_t*, uint32_t) {};
  const uint32_t rate = 19531;  // samples a second at 10 bits
  PlayerSettings settings{};
  settings.channels = 1;
  settings.shaper = {20, (1 << 20) - 1, 1023};
  settings.fade = {80, 409, 0};
  settings.touch_timeout = settings.most_late = 2000000000U;  // neither ends it here
  player.connect(hal);
  player.start(settings);
  Handover& handover = player.handover();
  const uint16_t full = 32768, current = 0;
  handover.stream.start(1, &current, false);
  auto play = [&](uint32_t seconds) {
    for (int k = 0; k < 64; ++k) handover.stream.push(&full);
    handover.news.store(handover.news.load() + 1);
    player.sample(seconds * rate);
    std::printf("%d\n", static_cast<int>(handover.fade_cause.load()));
  };
  handover.command.kind = Command::Kind::kStream;
  handover.command.starts_touch = true;
  handover.command.rate = settings.fade;
  handover.command_waits.store(1);
  play(0);
  play(86300);
  play(200);
}
"""


def test_a_stream_ends_after_a_day_and_not_before(tmp_path: Path) -> None:
    """It ended after 15.3 h: 2^30 samples."""
    source, program = tmp_path / "day.cpp", tmp_path / "day"
    source.write_text(PROGRAM, "utf-8")
    synthesis = CORE / "core" / "synthesis"
    files = [source, synthesis / "sample_player.cpp", synthesis / "rings" / "duty_ring.cpp"]
    command = ["g++", "-std=c++17", f"-I{CORE}", *map(str, files), "-o", str(program)]
    subprocess.run(command, check=True)
    causes = subprocess.run([program], capture_output=True, text=True, check=True).stdout.split()
    none, too_long = "0", "3"  # FadeCause
    assert causes == [none, none, too_long]
