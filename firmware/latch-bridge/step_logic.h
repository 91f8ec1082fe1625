// The latch bridge's clock of steps: blocks of time, and a pace that a hold brings down to nothing and back.
//
// Plain C++11 without Arduino, so that it can be tested on any machine (host.cpp and
// tests/unit/twin/test_latch_firmware.py compare it with the virtual bridge). Protocol:
// docs/reference/latch-bridge.md, version 1.

#ifndef KEMPELEN_STEP_LOGIC_H
#define KEMPELEN_STEP_LOGIC_H

#include <stdint.h>

#ifndef MOTORS
#define MOTORS 5
#endif

namespace kempelen {

const uint16_t TICKS_PER_MS = 4;   // the timer calls StepLogic::tick() this often
const uint16_t FULL = 1024;        // pace at full speed; it changes by one a tick: a hold takes 0.256 s
const uint8_t QUEUE = 64;          // blocks
const uint16_t LONGEST_MS = 10000; // of a block

// Half steps: which of a motor's four phases have current.
const uint8_t PHASES[8] = {0x1, 0x3, 0x2, 0x6, 0x4, 0xC, 0x8, 0x9};

inline uint8_t phase_nibble(int32_t count) { return PHASES[count & 7]; }

// CRC-16/CCITT-FALSE, one byte further.
inline uint16_t crc16(uint16_t crc, uint8_t byte) {
  crc ^= static_cast<uint16_t>(byte) << 8;
  for (uint8_t bit = 0; bit < 8; ++bit) crc = crc & 0x8000 ? (crc << 1) ^ 0x1021 : crc << 1;
  return crc;
}

struct Block {
  uint16_t milliseconds;
  int16_t steps[MOTORS];
};

class StepLogic {
 public:
  StepLogic() : first_(0), length_(0), pace_(FULL), wanted_(FULL), clock_(0) {
    for (uint8_t motor = 0; motor < MOTORS; ++motor) count_[motor] = made_[motor] = 0;
  }

  bool full() const { return length_ == QUEUE; }
  uint8_t room() const { return QUEUE - length_; }
  bool running() const { return length_ && (pace_ || wanted_); }
  bool empty() const { return !length_; }
  uint16_t pace() const { return pace_; }
  int32_t count(uint8_t motor) const { return count_[motor]; }

  // At rest: this place is called `count` from now on.
  void name(uint8_t motor, int32_t count) { count_[motor] = count; }

  // True when a block keeps to the fastest rate: one step of a motor in a tick.
  static bool possible(const Block& block) {
    if (block.milliseconds < 1 || block.milliseconds > LONGEST_MS) return false;
    const uint32_t most = static_cast<uint32_t>(block.milliseconds) * TICKS_PER_MS;
    for (uint8_t motor = 0; motor < MOTORS; ++motor)
      if (size(block.steps[motor]) > most) return false;
    return true;
  }

  bool push(const Block& block) {
    if (full()) return false;
    queue_[(first_ + length_) % QUEUE] = block;
    ++length_;
    return true;
  }

  void hold() { wanted_ = 0; }
  void resume() { wanted_ = FULL; }

  // Forget what has not been made; the counts stay.
  void drop() {
    length_ = 0;
    begin();
    pace_ = wanted_ = FULL;
    clock_ = 0;
  }

  // One tick of the timer; bit n is set where motor n has made a step, to be written to its latch.
  uint8_t tick() {
    if (!running()) return 0;
    if (pace_ < wanted_) ++pace_;
    if (pace_ > wanted_) --pace_;
    clock_ += pace_;
    uint8_t stepped = catch_up();
    while (length_ && clock_ >= total()) {
      clock_ -= total();
      first_ = (first_ + 1) % QUEUE;
      --length_;
      begin();
      stepped |= catch_up();
    }
    if (!length_) {
      pace_ = wanted_ = FULL;
      clock_ = 0;
    }
    return stepped;
  }

 private:
  static uint32_t size(int16_t steps) { return steps < 0 ? -static_cast<int32_t>(steps) : steps; }

  uint32_t total() const { return static_cast<uint32_t>(queue_[first_].milliseconds) * TICKS_PER_MS * FULL; }

  void begin() {
    for (uint8_t motor = 0; motor < MOTORS; ++motor) made_[motor] = 0;
  }

  // Make the steps that are due: of |steps| those whose middle the clock has passed.
  uint8_t catch_up() {
    if (!length_) return 0;
    const uint32_t whole = total();
    const uint32_t now = clock_ < whole ? clock_ : whole;
    uint8_t stepped = 0;
    for (uint8_t motor = 0; motor < MOTORS; ++motor) {
      const int16_t steps = queue_[first_].steps[motor];
      // Step k is due at clock (2k - 1) / (2 |steps|) of the whole.
      while (made_[motor] < size(steps) &&
             static_cast<uint64_t>(2 * made_[motor] + 1) * whole <= static_cast<uint64_t>(2) * size(steps) * now) {
        ++made_[motor];
        count_[motor] += steps > 0 ? 1 : -1;
        stepped |= static_cast<uint8_t>(1 << motor);
      }
    }
    return stepped;
  }

  Block queue_[QUEUE];
  uint8_t first_, length_;
  uint16_t pace_, wanted_;
  uint32_t clock_;
  int32_t count_[MOTORS];
  uint32_t made_[MOTORS];
};

}  // namespace kempelen

#endif
