// The line protocol of docs/reference/reed-board.md: writing lines, reading those of the host. No heap.
#pragma once

#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "reed_scan.h"

namespace reed {

constexpr int PROTOCOL_VERSION = 1;
constexpr uint32_t SNAPSHOT_MS = 100;
constexpr uint8_t LONGEST_LINE = 96;

inline uint16_t checksum(const char* body, uint8_t length) {
  uint16_t crc = 0xFFFF;  // CRC-16/CCITT-FALSE
  for (uint8_t i = 0; i < length; ++i) {
    crc ^= static_cast<uint16_t>(static_cast<uint8_t>(body[i]) << 8);
    for (uint8_t k = 0; k < 8; ++k)
      crc = static_cast<uint16_t>(crc & 0x8000 ? (crc << 1) ^ 0x1021 : crc << 1);
  }
  return crc;
}

// What the board is told to do.
struct Outside {
  virtual void send(const char* line, uint8_t length) = 0;
  virtual void light(const uint8_t* rows) = 0;
  virtual void sound(const char* name) = 0;
};

class Board {
 public:
  // `identity`: 8 hexadecimal digits of this very board; `wiring`: diodes, plain or direct.
  Board(Outside& outside, const char* identity, const char* wiring)
      : outside_(outside), identity_(identity), wiring_(wiring) {}

  void begin(const Scan& scan) {
    scanner_.begin(scan);
    hello();
  }

  void step(uint32_t now, const Scan& scan) {
    scanner_.step(now, scan, [this](const Event& event) { tell(event); });
    if (static_cast<int32_t>(now - due_) >= 0) {
      due_ = now + SNAPSHOT_MS;
      snapshot(now);
    }
  }

  bool at_rest() const { return scanner_.at_rest(); }

  // A byte from the host.
  void receive(uint32_t now, char byte) {
    if (byte == '\n') {
      if (overlong_) {
        refuse("long");
      } else {
        line_[length_] = 0;
        obey(now);
      }
      length_ = 0;
      overlong_ = false;
    } else if (byte != '\r') {
      if (length_ < LONGEST_LINE) {
        line_[length_++] = byte;
      } else {
        overlong_ = true;
      }
    }
  }

 private:
  void obey(uint32_t now) {
    if (!length_) return;
    char* star = strrchr(line_, '*');
    if (!star || strlen(star) != 5) return refuse("checksum");
    char told[8];
    const uint8_t body = static_cast<uint8_t>(star - line_);
    snprintf(told, sizeof told, "*%04X", checksum(line_, body));
    if (strcmp(star, told) != 0) return refuse("checksum");
    *star = 0;
    if (strcmp(line_, "H") == 0) return hello();
    if (line_[0] == 0 || line_[1] != ' ') return refuse("unknown");
    const char* word = line_ + 2;
    switch (line_[0]) {
      case 'S':
        return mark(now, word);
      case 'L':
        return lamps(word);
      case 'B':
        return buzz(word);
      default:
        return refuse("unknown");
    }
  }

  void mark(uint32_t now, const char* word) {
    uint32_t value = 0;
    if (!*word) return refuse("range");
    for (; *word; ++word) {
      if (*word < '0' || *word > '9') return refuse("range");
      value = value * 10 + static_cast<uint32_t>(*word - '0');
      if (value > 0xFFFF) return refuse("range");
    }
    mark_ = static_cast<uint16_t>(value);
    snapshot(now);
  }

  void lamps(const char* word) {
    uint8_t rows[8];
    if (strlen(word) != 16) return refuse("range");
    for (uint8_t row = 0; row < 8; ++row) {  // the first two digits are rank 8
      const int high = digit(word[2 * (7 - row)]), low = digit(word[2 * (7 - row) + 1]);
      if (high < 0 || low < 0) return refuse("range");
      rows[row] = static_cast<uint8_t>(high << 4 | low);
    }
    outside_.light(rows);
  }

  void buzz(const char* word) {
    if (strcmp(word, "off") && strcmp(word, "ok") && strcmp(word, "warn")) return refuse("range");
    outside_.sound(word);
  }

  static int digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    return -1;
  }

  void hello() {
    char body[LONGEST_LINE];
    snprintf(body, sizeof body, "H %d kempelen-reed %s %s 1", PROTOCOL_VERSION, identity_, wiring_);
    say(body);
  }

  void tell(const Event& event) {
    char body[LONGEST_LINE];
    const unsigned number = event.number;
    const unsigned long time = event.time;
    if (event.kind == Kind::kSneak || event.kind == Kind::kChatter) {
      char set[17];
      write_set(set, event.squares);
      const char* what = event.kind == Kind::kSneak ? "sneak" : "chatter";
      snprintf(body, sizeof body, "F %u %lu %s %s", number, time, what, set);
    } else {
      const char sign = event.kind == Kind::kLifted ? '-' : '+';
      const char* doubt = event.kind == Kind::kPlacedDoubtful ? "?" : "";
      snprintf(body, sizeof body, "E %u %lu %c%c%c%s", number, time, sign, 'a' + (event.square & 7),
               '1' + (event.square >> 3), doubt);
    }
    say(body);
  }

  void snapshot(uint32_t now) {
    char body[LONGEST_LINE], closed[17], doubtful[17];
    uint8_t rows[8];
    for (uint8_t row = 0; row < 8; ++row) rows[row] = scanner_.doubtful(row);
    write_set(closed, scanner_.stable());
    write_set(doubtful, rows);
    snprintf(body, sizeof body, "S %u %lu %s %s %u", static_cast<unsigned>(scanner_.number()),
             static_cast<unsigned long>(now), closed, doubtful, static_cast<unsigned>(mark_));
    say(body);
  }

  static void write_set(char* out, const uint8_t* rows) {
    const char* digits = "0123456789ABCDEF";
    for (uint8_t row = 0; row < 8; ++row) {
      out[2 * (7 - row)] = digits[rows[row] >> 4];
      out[2 * (7 - row) + 1] = digits[rows[row] & 15];
    }
    out[16] = 0;
  }

  void refuse(const char* why) {
    char body[16];
    snprintf(body, sizeof body, "N %s", why);
    say(body);
  }

  void say(const char* body) {
    char line[LONGEST_LINE + 8];
    const uint8_t length = static_cast<uint8_t>(strlen(body));
    const int all = snprintf(line, sizeof line, "%s*%04X\n", body, checksum(body, length));
    outside_.send(line, static_cast<uint8_t>(all));
  }

  Outside& outside_;
  const char* identity_;
  const char* wiring_;
  Scanner scanner_;
  char line_[LONGEST_LINE + 1];
  uint8_t length_ = 0;
  bool overlong_ = false;
  uint16_t mark_ = 0;
  uint32_t due_ = 0;
};

}  // namespace reed
