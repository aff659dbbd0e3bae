#include "tests/golden/golden_rows.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <regex>
#include <sstream>

#include "tests/support/paths/paths.h"

namespace drape::test {
namespace {

constexpr char kDeviceMark[] = "# device: ";
constexpr char kLibmMark[] = "# libm: ";

struct GoldenFile {
  std::string device;
  std::string libm;
  GoldenRows rows;
};

std::filesystem::path PathOf(const std::string& name) {
  return SourcePath("tests/golden/states/" + name + ".txt");
}

void Write(const std::string& name, const GoldenFile& golden) {
  std::ofstream file(PathOf(name));
  if (!golden.device.empty()) file << kDeviceMark << golden.device << "\n";
  file << kLibmMark << golden.libm << "\n";
  for (const auto& [key, hash] : golden.rows) file << key << " " << hash << "\n";
  ASSERT_TRUE(file.flush()) << PathOf(name);
}

GoldenFile Read(const std::string& name) {
  GoldenFile golden;
  std::ifstream file(PathOf(name));
  EXPECT_TRUE(file) << "no file " << PathOf(name);
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(kDeviceMark)) {
      golden.device = line.substr(sizeof(kDeviceMark) - 1);
    } else if (line.starts_with(kLibmMark)) {
      golden.libm = line.substr(sizeof(kLibmMark) - 1);
    } else {
      const size_t blank = line.find(' ');
      golden.rows[line.substr(0, blank)] = line.substr(blank + 1);
    }
  }
  return golden;
}

}  // namespace

void StateHash::Add(std::string_view bytes) {
  for (const char byte : bytes) {
    value_ = (value_ ^ static_cast<unsigned char>(byte)) * 1099511628211u;
  }
}

std::string StateHash::Text() const {
  std::ostringstream text;
  text << std::hex << std::setw(16) << std::setfill('0') << value_;
  return text.str();
}

std::string GoldenDevice(const std::string& backend, const std::string& device) {
  if (backend != "gl") return "";
  std::smatch found;
  return std::regex_search(device, found, std::regex(".*Mesa [0-9.]+")) ? found.str() : device;
}

std::string LibmHash() {
  StateHash hash;
  const auto add = [&](auto value) {
    hash.Add({reinterpret_cast<const char*>(&value), sizeof(value)});
  };
  for (int k = 1; k < 20000; ++k) {
    volatile double x = 0.00137 * k;  // volatile: the compiler must not compute the results
    add(std::exp(-x));
    add(std::log(x));
    add(std::sin(x));
    add(std::cos(x));
    add(std::tan(x));
    add(std::atan2(x, 3.0));
    add(std::pow(x, 1.7));
    add(std::exp(static_cast<float>(-x)));
    add(std::sin(static_cast<float>(x)));
    add(std::cos(static_cast<float>(x)));
    add(std::pow(static_cast<float>(x), 1.7F));
  }
  return hash.Text();
}

void ExpectGolden(const std::string& name, const std::string& device, const GoldenRows& rows) {
  const char* record = std::getenv("DRAPE_RECORD_GOLDEN");
  if (record != nullptr && std::string(record) == "1") {
    Write(name, {device, LibmHash(), rows});
    return;
  }
  const GoldenFile golden = Read(name);
  ASSERT_EQ(LibmHash(), golden.libm)
      << "the C library computes other bits than the one that the hashes hold for: glibc 2.36 "
         "(Debian 12) on x86-64 without FMA";
  ASSERT_EQ(device, golden.device) << "the hashes hold for another device";
  std::string lines;
  for (const auto& [key, hash] : rows) {
    const auto found = golden.rows.find(key);
    if (found == golden.rows.end() || found->second != hash) lines += key + " " + hash + "\n";
  }
  for (const auto& [key, hash] : golden.rows) {
    if (!rows.contains(key)) lines += key + " (no such case)\n";
  }
  EXPECT_EQ(lines, "") << "states of tests/golden/states/" << name << ".txt that are others now";
}

}  // namespace drape::test
