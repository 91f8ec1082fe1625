// The scan's logic: debounce, order of events, missing diodes. No pins, no clock, no heap: it runs on an
// Arduino-class board and on the host, where the tests hold it against the twin's own (twin/reed/scanner.py).
//
// Row r, column c carry square 8 r + c: a1 is row 0, column 0; h1 row 0, column 7.
#pragma once

#include <stdint.h>

namespace reed {

constexpr uint32_t DEBOUNCE_MS = 20;
constexpr uint32_t CHATTER_MS = 250;
constexpr uint16_t CHATTER_EDGES = 12;

// One reading of everything.
struct Scan {
  uint8_t closed[8];  // columns that are live while a row is driven
  uint8_t live[8];    // other rows that are live with it: a current flows back through a switch without diode
};

enum class Kind : uint8_t { kLifted, kPlaced, kPlacedDoubtful, kSneak, kChatter };

struct Event {
  Kind kind;
  uint16_t number;
  uint32_t time;
  uint8_t square;      // of a change
  uint8_t squares[8];  // of a finding, by rows
};

inline bool bit(const uint8_t* rows, uint8_t square) { return rows[square >> 3] >> (square & 7) & 1; }
inline void put(uint8_t* rows, uint8_t square, bool on) {
  const uint8_t mask = static_cast<uint8_t>(1u << (square & 7));
  rows[square >> 3] = on ? rows[square >> 3] | mask : rows[square >> 3] & static_cast<uint8_t>(~mask);
}

class Scanner {
 public:
  // The first reading after power-up is how things are, not news.
  void begin(const Scan& scan) {
    for (uint8_t row = 0; row < 8; ++row) {
      stable_[row] = raw_[row] = scan.closed[row];
      moving_[row] = chattering_[row] = cleared_[row] = suspected_[row] = 0;
    }
    note_doubtful(scan);
  }

  // Take in a reading at `now` ms; `tell(event)` is called for each event, in order.
  template <typename Tell>
  void step(uint32_t now, const Scan& scan, Tell tell) {
    note_edges(now, scan);
    note_doubtful(scan);
    chatter(now, tell);
    settle(now, tell);
    if (at_rest()) sneaks(now, scan, tell);
  }

  bool at_rest() const {
    for (uint8_t row = 0; row < 8; ++row)
      if (moving_[row]) return false;
    return true;
  }

  uint16_t number() const { return number_; }
  const uint8_t* stable() const { return stable_; }
  uint8_t doubtful(uint8_t row) const { return stable_[row] & doubtful_[row]; }

 private:
  void note_doubtful(const Scan& scan) {
    for (uint8_t row = 0; row < 8; ++row) {
      doubtful_[row] = 0;
      for (uint8_t other = 0; other < 8; ++other)
        if (scan.live[row] >> other & 1) doubtful_[row] |= scan.closed[row] & scan.closed[other];
    }
  }

  void note_edges(uint32_t now, const Scan& scan) {
    for (uint8_t square = 0; square < 64; ++square) {
      if (bit(scan.closed, square) == bit(raw_, square)) continue;
      if (!bit(moving_, square)) {
        put(moving_, square, true);
        first_[square] = now;
        edges_[square] = 0;
      }
      last_[square] = now;
      ++edges_[square];
    }
    for (uint8_t row = 0; row < 8; ++row) raw_[row] = scan.closed[row];
  }

  template <typename Tell>
  void chatter(uint32_t now, Tell tell) {
    for (uint8_t square = 0; square < 64; ++square) {
      if (!bit(moving_, square) || bit(chattering_, square)) continue;
      if (edges_[square] < CHATTER_EDGES || now - first_[square] < CHATTER_MS) continue;
      put(chattering_, square, true);
      Event event{Kind::kChatter, next(), now, square, {0}};
      put(event.squares, square, true);
      tell(event);
    }
  }

  // Changes that are certain, and that no earlier one may still precede: in the order of their first edges, a
  // lift before a placing of the same moment.
  template <typename Tell>
  void settle(uint32_t now, Tell tell) {
    uint8_t ready[8] = {0};
    bool waits = false;
    uint32_t oldest = 0;  // age of the oldest change that is not certain yet
    for (uint8_t square = 0; square < 64; ++square) {
      if (!bit(moving_, square)) continue;
      const bool still = now - last_[square] >= DEBOUNCE_MS;
      if (still && bit(raw_, square) == bit(stable_, square)) {
        rest(square);
      } else if (still) {
        put(ready, square, true);
      } else if (!bit(chattering_, square)) {
        const uint32_t age = now - first_[square];
        if (!waits || age > oldest) oldest = age;
        waits = true;
      }
    }
    for (;;) {
      int best = -1;
      for (uint8_t square = 0; square < 64; ++square)
        if (bit(ready, square) && (best < 0 || before(now, square, static_cast<uint8_t>(best)))) best = square;
      if (best < 0 || (waits && now - first_[best] < oldest)) return;
      put(ready, static_cast<uint8_t>(best), false);
      change(static_cast<uint8_t>(best), tell);
    }
  }

  bool before(uint32_t now, uint8_t one, uint8_t other) const {
    const uint32_t a = now - first_[one], b = now - first_[other];
    if (a != b) return a > b;
    return !bit(raw_, one) && bit(raw_, other);
  }

  template <typename Tell>
  void change(uint8_t square, Tell tell) {
    rest(square);
    const bool placed = !bit(stable_, square);
    put(stable_, square, placed);
    const Kind kind =
        !placed ? Kind::kLifted : bit(doubtful_, square) ? Kind::kPlacedDoubtful : Kind::kPlaced;
    tell(Event{kind, next(), first_[square], square, {0}});
  }

  void rest(uint8_t square) {
    put(moving_, square, false);
    put(chattering_, square, false);
  }

  // A missing diode: where a current may have come back, but for squares where it was seen not to.
  template <typename Tell>
  void sneaks(uint32_t now, const Scan& scan, Tell tell) {
    for (uint8_t driven = 0; driven < 8; ++driven)
      for (uint8_t other = 0; other < 8; ++other)
        if (other != driven && !scan.live[driven] && !scan.live[other])
          cleared_[other] |= scan.closed[driven] & scan.closed[other];
    Event event{Kind::kSneak, 0, now, 0, {0}};
    bool any = false, news = false;
    for (uint8_t driven = 0; driven < 8; ++driven)
      for (uint8_t other = 0; other < 8; ++other) {
        if (!(scan.live[driven] >> other & 1)) continue;
        const uint8_t some = scan.closed[driven] & scan.closed[other];
        if (!(some & ~cleared_[other])) cleared_[other] &= static_cast<uint8_t>(~some);
        event.squares[other] |= some & static_cast<uint8_t>(~cleared_[other]);
      }
    for (uint8_t row = 0; row < 8; ++row) {
      any = any || event.squares[row];
      news = news || event.squares[row] != suspected_[row];
    }
    if (!any || !news) return;
    for (uint8_t row = 0; row < 8; ++row) suspected_[row] = event.squares[row];
    event.number = next();
    tell(event);
  }

  uint16_t next() { return ++number_; }

  uint8_t stable_[8], raw_[8], doubtful_[8], moving_[8], chattering_[8], cleared_[8], suspected_[8];
  uint32_t first_[64], last_[64];
  uint16_t edges_[64];
  uint16_t number_ = 0xFFFF;
};

}  // namespace reed
