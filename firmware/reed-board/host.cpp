// The firmware on a PC: readings come as lines on standard input, the host's bytes too, the board's lines go to
// standard output. For the tests.
//
//   begin MS CLOSED LIVE     a first reading: 16 hexadecimal digits each; LIVE by rows, row 0 first
//   scan MS CLOSED LIVE      a further one
//   host MS TEXT             a line of the host's, without its newline
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "reed_protocol.h"

struct Stdout : reed::Outside {
  void send(const char* line, uint8_t length) override { fwrite(line, 1, length, stdout); }
  void light(const uint8_t* rows) override {
    printf("# lamps ");
    for (int row = 7; row >= 0; --row) printf("%02X", rows[row]);
    printf("\n");
  }
  void sound(const char* name) override { printf("# sound %s\n", name); }
};

static uint64_t closed_of(const char* text) { return strtoull(text, nullptr, 16); }

int main(int argc, char** argv) {
  Stdout out;
  reed::Board board(out, argc > 1 ? argv[1] : "00000001", argc > 2 ? argv[2] : "diodes");
  static char line[512];
  while (fgets(line, sizeof line, stdin)) {
    char word[8] = "", first[64] = "", second[64] = "";
    unsigned long now = 0;
    int used = 0;
    if (sscanf(line, "%7s %lu %n", word, &now, &used) < 2) return 2;
    const uint32_t ms = static_cast<uint32_t>(now);
    if (strcmp(word, "host") == 0) {
      for (const char* c = line + used; *c; ++c) board.receive(ms, *c);
    } else {
      if (sscanf(line + used, "%63s %63s", first, second) < 2) return 2;
      reed::Scan scan;
      const uint64_t closed = closed_of(first);
      for (int row = 0; row < 8; ++row) {
        const char pair[3] = {second[2 * row], second[2 * row + 1], 0};
        scan.closed[row] = static_cast<uint8_t>(closed >> 8 * row);
        scan.live[row] = static_cast<uint8_t>(strtoul(pair, nullptr, 16));
      }
      if (strcmp(word, "begin") == 0) {
        board.begin(scan);
      } else {
        board.step(ms, scan);
      }
    }
    fflush(stdout);
  }
  return 0;
}
