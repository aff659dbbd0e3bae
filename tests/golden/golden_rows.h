// Hashes of states, and the committed files that they are compared with.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

namespace drape::test {

// FNV-1a of 64 bits: the same on every machine.
class StateHash {
 public:
  void Add(std::string_view bytes);
  std::string Text() const;  // 16 hexadecimal digits

 private:
  uint64_t value_ = 14695981039346656037u;
};

// The hash of every case of a file, by the case's name (no blanks).
using GoldenRows = std::map<std::string, std::string>;

// Compares with tests/golden/states/<name>.txt and fails with a line for every case that differs,
// is missing or is new. With DRAPE_RECORD_GOLDEN=1 it writes the file instead. `device`: the device
// that the hashes hold for besides the machine's arithmetic; "" if for any.
void ExpectGolden(const std::string& name, const std::string& device, const GoldenRows& rows);

// The device of a backend for ExpectGolden; "" if bits do not depend on it. For gl: the
// renderer and its version without the width of its vectors, which depends on the processor and
// changes no bit.
std::string GoldenDevice(const std::string& backend, const std::string& device);

// A hash of results of libm in this process. See main.cpp.
std::string LibmHash();

}  // namespace drape::test
