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
// is missing or is new. With DRAPE_RECORD_GOLDEN=1 it writes the file instead. `device`: what the
// hashes hold for besides the machine's arithmetic; "" if nothing.
void ExpectGolden(const std::string& name, const std::string& device, const GoldenRows& rows);

// Of a backend's name and device: "" where bits do not depend on the device; for gl the renderer
// and its version without the width of its vectors, which depends on the processor and changes no
// bit.
std::string GoldenDevice(const std::string& backend, const std::string& device);

// What this process gets from libm, as a hash. See main.cpp.
std::string LibmHash();

}  // namespace drape::test
