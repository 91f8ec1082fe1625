// Drives step_logic.h from a script on standard input, for tests on a computer.
//
//   push MS S1 .. S5    hold    resume    drop    tick N    crc TEXT
//
// After each line but push: counts of all motors, their nibbles, room in the queue and pace.

#include <cstdio>
#include <iostream>
#include <sstream>
#include <string>

#include "step_logic.h"

using namespace kempelen;

static void tell(const StepLogic& logic) {
  for (int motor = 0; motor < MOTORS; ++motor) std::cout << logic.count(motor) << ' ';
  for (int motor = 0; motor < MOTORS; ++motor) std::cout << int(phase_nibble(logic.count(motor))) << ' ';
  std::cout << int(logic.room()) << ' ' << logic.pace() << '\n';
}

int main() {
  StepLogic logic;
  std::string line, word;
  while (std::getline(std::cin, line)) {
    std::istringstream words(line);
    words >> word;
    if (word == "push") {
      Block block;
      words >> block.milliseconds;
      for (int motor = 0; motor < MOTORS; ++motor) words >> block.steps[motor];
      std::cout << (!StepLogic::possible(block) ? "impossible" : logic.push(block) ? "pushed" : "full") << '\n';
      continue;
    }
    if (word == "crc") {
      uint16_t crc = 0xFFFF;
      for (char c : line.substr(4)) crc = crc16(crc, uint8_t(c));
      std::printf("%04X\n", crc);
      std::fflush(stdout);
      continue;
    }
    if (word == "hold") logic.hold();
    if (word == "resume") logic.resume();
    if (word == "drop") logic.drop();
    int ticks = 0;
    if (word == "tick") words >> ticks;
    while (ticks--) logic.tick();
    tell(logic);
  }
}
