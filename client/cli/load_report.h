// The numbers of `drape load`: pure, no clock, no server.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace drape::cli {

// What the clients of one window have measured, together.
struct LoadSamples {
  std::vector<double> latencies_ms;        // of requests that succeeded, without the warm-up
  uint64_t delayed = 0;                    // sent late, or not at all: every client was busy
  std::map<std::string, uint64_t> errors;  // failed requests by reason
  double wall_s = 0;
  uint64_t cloth_steps = 0;
  // Sums over the requests that succeeded, as the server measured them [us].
  uint64_t queue_us = 0;
  uint64_t upload_us = 0;
  uint64_t device_us = 0;
  uint64_t readback_us = 0;
  uint64_t encode_us = 0;
  std::vector<double> frame_ages_ms;  // of the viewers' frames
  uint64_t frames_dropped = 0;

  void Add(const LoadSamples& other);
  uint64_t error_count() const;
};

// The load that was asked for.
struct LoadLevel {
  uint32_t clients = 1;
  double rate_per_s = 0;  // of all clients together; 0: each asks again as soon as it is answered
};

// The smallest value that at least `percent` % of the values do not exceed (nearest rank); 0
// without values. `percent` in (0, 100].
double Percentile(std::span<const double> values, double percent);

// Whether the last three windows agree: each has as many requests per second, and the same latency
// at `percent`, as their mean to within `tolerance_percent`. False for fewer windows, or if one has
// no request that succeeded.
bool IsStable(std::span<const LoadSamples> windows, double percent, double tolerance_percent);

// One line of the table and of the CSV file.
struct LoadRow {
  LoadLevel level;
  bool is_stable = false;
  LoadSamples samples;
};

// For programs: names and values of one row. `percent`: a further column of this percentile, 0:
// none. Times are means over the requests, but for those that name a percentile.
std::string LoadCsvHeader(double percent);
std::string LoadCsvLine(const LoadRow& row, double percent);
std::string LoadJson(const std::vector<LoadRow>& rows, double percent);

// For people.
std::string LoadTable(const std::vector<LoadRow>& rows, double percent);

}  // namespace drape::cli
