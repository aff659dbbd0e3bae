#include "tests/bench/bench.h"

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "tests/bench/machine.h"
#include "tests/support/backends/backends.h"

namespace drape::bench {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr char kMachineFile[] = "machine.json";

// The notes of earlier runs into the same folder: a table that is not measured again keeps its own.
Json EarlierTables(const fs::path& folder) {
  std::ifstream file(folder / kMachineFile);
  const Json earlier = Json::parse(file, nullptr, /*allow_exceptions=*/false);
  if (!earlier.is_object() || !earlier.contains("tables")) return Json::object();
  return earlier["tables"];
}

}  // namespace

Bench::Bench(BenchOptions options) : options_(std::move(options)) {
  std::string gpu_renderer;
  bool has_gpu = false;
  for (const std::string& name : options_.backends) {
    backends_.push_back({name, test::MakeBackend(name)});
    const BackendDescription description = backends_.back().backend->Describe();
    std::printf("%-10s %s\n", name.c_str(), description.device.c_str());
    if (name == "gl") gl_device_ = description.device;
    if (name == "cpu") cpu_device_ = description.device;
    if (description.is_hardware_gpu) {
      has_gpu = true;
      gpu_renderer = description.device.substr(0, description.device.find(','));
    }
  }
  const std::string fast = has_gpu ? "gl" : "cpu";
  fast_ = {fast, test::MakeBackend(fast)};
  reference_ = {"reference", test::MakeBackend("reference")};
  machine_ =
      options_.machine.empty() ? MachineName(DescribeMachine(), gpu_renderer) : options_.machine;
  out_ =
      options_.out.empty() ? options_.results_root / machine_ / options_.subfolder : options_.out;
  std::error_code error;
  fs::create_directories(out_, error);
  if (error) throw std::runtime_error("cannot make --out " + out_.string());
  WriteMachineFile();
  std::printf("results go to %s\n", out_.c_str());
}

Table Bench::OpenTable(const std::string& name, const std::vector<std::string>& columns) {
  std::printf("\n%s.csv\n", name.c_str());
  tables_.push_back(name);
  WriteMachineFile();
  return Table(out_ / (name + ".csv"), columns);
}

bool Bench::StartRow(const std::string& what) {
  const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - start_;
  const bool is_over = options_.budget_s > 0 && passed.count() > share_ * options_.budget_s;
  std::printf("[%5.0f s] %s%s\n", passed.count(), what.c_str(),
              is_over ? ": left out with the rest of this table: --budget-s is used up" : "");
  std::fflush(stdout);
  return !is_over;
}

void Bench::WriteMachineFile() const {
  const Machine machine = DescribeMachine();
  Json tables = EarlierTables(out_);
  for (const std::string& name : tables_) {
    tables[name] = {{"command", options_.command}, {"date", UtcNow()}, {"commit", options_.commit}};
  }
  const Json json = {{"machine", machine_},
                     {"cpu", machine.cpu},
                     {"cores", machine.cores},
                     {"instruction_sets", machine.instruction_sets},
                     {"cpu_backend", cpu_device_},
                     {"gl", gl_device_},
                     {"compiler", machine.compiler},
                     {"flags", machine.flags},
                     {"drape_version", DRAPE_VERSION},
                     {"tables", tables}};
  std::ofstream file(out_ / kMachineFile);
  file << json.dump(1) << "\n";
  if (!file.flush()) throw std::runtime_error("cannot write " + (out_ / kMachineFile).string());
}

}  // namespace drape::bench
