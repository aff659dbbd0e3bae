// A progress bar on a terminal, and requests to stop.
#pragma once

#include <cstdint>
#include <string>

namespace drape::cli {

// Draws on stderr if that is a terminal; otherwise draws nothing. One thread.
class ProgressBar {
 public:
  ProgressBar(std::string label, uint64_t total, bool is_quiet);
  ~ProgressBar();  // removes the bar
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void Show(uint64_t done);

 private:
  const std::string label_;
  const uint64_t total_;
  const bool is_drawn_;
  int last_percent_ = -1;
};

// While it lives, the first SIGINT or SIGTERM only requests a stop; the second ends the process as
// usual. One at a time.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  bool is_interrupted() const;
};

}  // namespace drape::cli
