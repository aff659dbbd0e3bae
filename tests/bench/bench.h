// The context of every subcommand of drape_bench: backends, folder of the tables, time to measure.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/bench/table.h"
#include "tests/bench/timing.h"

namespace drape::bench {

struct BenchOptions {
  std::vector<std::string> backends = {"cpu", "gl", "reference"};
  bool is_quick = false;      // smallest sizes, fewest repeats: whether everything works
  std::string machine;        // folder of the results; empty: from processor and GPU
  std::filesystem::path out;  // empty: results_root / machine / subfolder
  std::filesystem::path results_root = "tests/bench/results";
  std::filesystem::path subfolder;
  TimingLimits limits;
  double budget_s = 0;  // no new row after that long; 0: no limit
  std::string commit;   // measured commit, for machine.json
  std::string command;  // command that makes the same tables, for machine.json
};

class Bench {
 public:
  // Makes the backends, the folder of the results and its machine.json. std::runtime_error if the
  // folder cannot be written; a backend that cannot be made ends the process with the reason.
  explicit Bench(BenchOptions options);

  const BenchOptions& options() const { return options_; }
  bool is_quick() const { return options_.is_quick; }
  const TimingLimits& limits() const { return options_.limits; }
  std::span<NamedBackend> backends() { return backends_; }
  const std::filesystem::path& out() const { return out_; }

  // The backend that brings a scene to the state in which it is measured: "gl" on a GPU, else
  // "cpu".
  NamedBackend& fast_backend() { return fast_; }
  NamedBackend& reference() { return reference_; }

  // out/NAME.csv, and a note in machine.json of the command that made it.
  Table OpenTable(const std::string& name, const std::vector<std::string>& columns);

  // Rows may start until this share of the budget, in (0, 1], is used up. Initially 1.
  void AllowShare(double share) { share_ = share; }
  // Prints which row comes next. False when its share is used up, which it prints too: the caller
  // stops.
  bool StartRow(const std::string& what);

 private:
  void WriteMachineFile() const;

  BenchOptions options_;
  double share_ = 1;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::vector<NamedBackend> backends_;
  NamedBackend fast_;
  NamedBackend reference_;
  std::string gl_device_;   // empty without the backend gl
  std::string cpu_device_;  // with its lanes; empty without the backend cpu
  std::string machine_;
  std::filesystem::path out_;
  std::vector<std::string> tables_;
};

}  // namespace drape::bench
