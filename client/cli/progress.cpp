#include "client/cli/progress.h"

#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <utility>

namespace drape::cli {
namespace {

constexpr int kBarCells = 30;
// The only data that a signal handler may touch.
volatile std::sig_atomic_t interrupt_count = 0;

extern "C" void OnInterrupt(int) {
  interrupt_count = 1;
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
}

}  // namespace

ProgressBar::ProgressBar(std::string label, uint64_t total, bool is_quiet)
    : label_(std::move(label)),
      total_(total),
      is_drawn_(!is_quiet && total > 0 && isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() {
  if (is_drawn_) std::fprintf(stderr, "\r\033[K");
}

void ProgressBar::Show(uint64_t done) {
  if (!is_drawn_) return;
  const double part = static_cast<double>(done) / static_cast<double>(total_);
  const int percent = static_cast<int>(part * 100);
  if (percent == last_percent_) return;
  last_percent_ = percent;
  const int cells = static_cast<int>(part * kBarCells);
  const std::string bar = std::string(static_cast<size_t>(cells), '#') +
                          std::string(static_cast<size_t>(kBarCells - cells), '-');
  std::fprintf(stderr, "\r%s [%s] %3d %%", label_.c_str(), bar.c_str(), percent);
  std::fflush(stderr);
}

InterruptGuard::InterruptGuard() {
  interrupt_count = 0;
  std::signal(SIGINT, OnInterrupt);
  std::signal(SIGTERM, OnInterrupt);
}

InterruptGuard::~InterruptGuard() {
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
}

bool InterruptGuard::is_interrupted() const {
  return interrupt_count != 0;
}

}  // namespace drape::cli
