// drape load: many clients at once, and what they wait for.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "client/cli/commands.h"
#include "client/cli/load_run.h"
#include "client/cli/options.h"
#include "drape/scene_file.h"

namespace drape::cli {
namespace {

// START, START:END or START:END:STEP; both ends belong to it.
struct LoadRange {
  double start = 1;
  double end = 1;
  double step = 1;

  std::vector<double> Values() const {
    std::vector<double> values;
    // Counted, so that rounding loses no value.
    const double count = std::floor((end - start) / step + 1e-9);
    for (double k = 0; k <= count; ++k) values.push_back(start + k * step);
    return values;
  }
};

constexpr double kMaxClients = 4096;
constexpr double kMaxRate_per_s = 1e6;
constexpr size_t kMaxLevels = 1000;

struct LoadFlags {
  ServerOptions server;
  std::string scene;
  std::vector<std::string> sets;
  uint32_t side = 16;
  uint32_t cloths = 1;
  std::string concurrency;
  std::string rate;
  uint32_t max_threads = 16;
  double interval_ms = 5000;
  double request_timeout_s = 60;
  double percent = 0;
  double stability_percent = 10;
  uint32_t max_trials = 10;
  double latency_threshold_ms = 0;
  std::string csv;
  bool is_json = false;
  LoadPlan plan;
};

LoadRange ParseRange(const std::string& flag, const std::string& text, double max) {
  LoadRange range;
  double* const parts[] = {&range.start, &range.end, &range.step};
  size_t begin = 0, count = 0;
  bool is_legal = true;
  while (is_legal && begin <= text.size()) {
    const size_t colon = std::min(text.find(':', begin), text.size());
    is_legal =
        count < 3 && CLI::detail::lexical_cast(text.substr(begin, colon - begin), *parts[count]);
    ++count;
    begin = colon + 1;
  }
  if (count == 1) range.end = range.start;
  is_legal = is_legal && range.start > 0 && range.end >= range.start && range.end <= max &&
             range.step > 0 && (range.end - range.start) / range.step < kMaxLevels;
  if (is_legal) return range;
  char limits[96];
  std::snprintf(limits, sizeof limits, " is not START[:END[:STEP]] with 0 < START <= END <= %g",
                max);
  throw CLI::ValidationError(flag, text + limits + ", STEP > 0 and 1000 levels at most");
}

std::vector<LoadLevel> LevelsOf(const LoadFlags& flags) {
  std::vector<LoadLevel> levels;
  if (!flags.rate.empty()) {
    for (const double rate :
         ParseRange("--request-rate-range", flags.rate, kMaxRate_per_s).Values()) {
      levels.push_back({flags.max_threads, rate});
    }
    return levels;
  }
  const std::string text = flags.concurrency.empty() ? "1" : flags.concurrency;
  for (const double clients : ParseRange("--concurrency-range", text, kMaxClients).Values()) {
    if (clients != std::floor(clients)) {
      throw CLI::ValidationError("--concurrency-range",
                                 text + " has a level that is no whole number");
    }
    levels.push_back({static_cast<uint32_t>(clients), 0});
  }
  return levels;
}

// Sheets that hang from two corners and never sleep: every step is computed.
v1::Scene HangingSheets(const LoadFlags& flags) {
  const nlohmann::json spec = {
      {"grid", {{"columns", flags.side}, {"rows", flags.side}, {"width_m", 1}, {"height_m", 1}}},
      {"pins", {{{"particle", 0}}, {{"particle", flags.side - 1}}}},
      {"settings", {{"sleep_motion_m", 0}}}};
  const nlohmann::json scene = {{"name", "load"},
                                {"cloths", {{{"count", flags.cloths}, {"spec", spec}}}}};
  return ParseScene(scene.dump(), {}, flags.sets);
}

LoadRow Measure(LoadClients& clients, const LoadLevel& level, const LoadFlags& flags) {
  std::vector<LoadSamples> windows;
  const double percent = flags.percent > 0 ? flags.percent : 50;
  LoadRow row{level, false, {}};
  for (uint32_t trial = 0; trial < flags.max_trials && !row.is_stable; ++trial) {
    windows.push_back(clients.RunWindow(level));
    row.is_stable = IsStable(windows, percent, flags.stability_percent);
  }
  const size_t kept = std::min<size_t>(windows.size(), 3);
  for (size_t k = windows.size() - kept; k < windows.size(); ++k) row.samples.Add(windows[k]);
  return row;
}

// The file gets each row when it is there: a run that is cut short has kept what it measured.
std::ofstream OpenCsv(const LoadFlags& flags) {
  std::ofstream csv;
  if (flags.csv.empty()) return csv;
  csv.open(flags.csv);
  csv << LoadCsvHeader(flags.percent) << std::flush;
  if (!csv) throw std::runtime_error("cannot write " + flags.csv);
  return csv;
}

bool IsTooSlow(const LoadRow& row, const LoadFlags& flags) {
  if (flags.latency_threshold_ms == 0) return false;
  const double percent = flags.percent > 0 ? flags.percent : 50;
  return Percentile(row.samples.latencies_ms, percent) > flags.latency_threshold_ms;
}

int Load(LoadFlags flags) {
  const std::vector<LoadLevel> levels = LevelsOf(flags);
  LoadPlan& plan = flags.plan;
  plan.interval_s = flags.interval_ms * 1e-3;
  plan.scene = flags.scene.empty() ? HangingSheets(flags) : LoadScene(flags.scene, flags.sets);
  flags.server.address.connect.request_timeout_s = flags.request_timeout_s;
  flags.server.address.connect.retries.max_tries = 1;  // it counts what fails
  const Client first = flags.server.Open();
  plan.limits = first.GetServerInfo().limits();
  ServerAddress address = flags.server.address;
  address.server = first.address();
  plan.connect = [address] { return address.Connect(); };
  std::ofstream csv = OpenCsv(flags);
  LoadClients clients(plan);
  std::vector<LoadRow> rows;
  bool has_success = true;
  for (const LoadLevel& level : levels) {
    rows.push_back(Measure(clients, level, flags));
    has_success = has_success && !rows.back().samples.latencies_ms.empty();
    if (csv.is_open()) csv << LoadCsvLine(rows.back(), flags.percent) << std::flush;
    if (!flags.is_json) std::cout << LoadTable({rows.back()}, flags.percent) << std::flush;
    if (IsTooSlow(rows.back(), flags)) break;
  }
  if (flags.is_json) std::cout << LoadJson(rows, flags.percent);
  return has_success ? kDone : kFailed;
}

void AddScene(CLI::App& load, LoadFlags& flags) {
  auto* scene = load.add_option(
      "--scene", flags.scene, "Cloths of every client (default: sheets that hang by two corners)");
  scene->type_name("SCENE.json");
  load.add_option("--side", flags.side, "Particles along a side of those sheets (default: 16)")
      ->check(CLI::Range(2, 4096))
      ->type_name("N")
      ->excludes(scene);
  load.add_option("--cloths", flags.cloths, "How many sheets each client has (default: 1)")
      ->check(CLI::Range(1, 1 << 20))
      ->type_name("N")
      ->excludes(scene);
  load.add_option("--set", flags.sets,
                  "Set a field of every cloth's spec, e.g. settings.substeps=8")
      ->allow_extra_args(false)
      ->type_name("PATH=VALUE");
  const std::map<std::string, LoadRequest> requests = {{"step", LoadRequest::kStep},
                                                       {"create", LoadRequest::kCreate},
                                                       {"session", LoadRequest::kSession}};
  load.add_option_function<std::string>(
          "--request",
          [&flags, requests](const std::string& name) { flags.plan.request = requests.at(name); },
          "What a request is: a step, cloths created and deleted (create), or with their session "
          "(session) (default: step)")
      ->check(CLI::IsMember({"step", "create", "session"}))
      ->type_name("KIND");
  load.add_option("--steps", flags.plan.steps, "Steps per request (default: 1)")
      ->check(CLI::Range(1, 1 << 30))
      ->type_name("N");
  load.add_flag("--positions", flags.plan.has_positions, "Answers bring all positions");
  load.add_flag("--streaming", flags.plan.by_stream, "StepStream instead of single Steps");
}

void AddLevels(CLI::App& load, LoadFlags& flags) {
  auto* concurrency =
      load.add_option("--concurrency-range", flags.concurrency,
                      "Clients that each ask again as soon as they are answered (default: 1)");
  concurrency->type_name("START[:END[:STEP]]");
  auto* rate =
      load.add_option("--request-rate-range", flags.rate,
                      "Requests per second of all clients together, sent when they are due");
  rate->type_name("START[:END[:STEP]]")->excludes(concurrency);
  load.add_option("--request-distribution",
                  "How they are spaced: constant or poisson (default: constant)")
      ->each([&flags](const std::string& name) { flags.plan.is_poisson = name == "poisson"; })
      ->check(CLI::IsMember({"constant", "poisson"}))
      ->needs(rate)
      ->type_name("KIND");
  load.add_option("--max-threads", flags.max_threads, "Clients that send them (default: 16)")
      ->check(CLI::Range(1, static_cast<int>(kMaxClients)))
      ->needs(rate)
      ->type_name("N");
  load.add_option("-p,--measurement-interval", flags.interval_ms, "Of a window (default: 5000)")
      ->check(CLI::Range(1.0, 86.4e6))
      ->check(FiniteNumber())
      ->type_name("MS");
  load.add_option("--request-count", flags.plan.request_count,
                  "A window also ends after this many requests (default: no limit)")
      ->type_name("N");
  load.add_option("--warmup-request-count", flags.plan.warm_up_requests,
                  "Of each client, not counted (default: 10)")
      ->type_name("N");
  load.add_option("-s,--stability-percentage", flags.stability_percent,
                  "Three windows in a row may differ by so much from their mean (default: 10)")
      ->check(CLI::Range(0.0, 1000.0))
      ->check(FiniteNumber())
      ->type_name("PERCENT");
  load.add_option("-r,--max-trials", flags.max_trials,
                  "Windows at most; the last three count (default: 10)")
      ->check(CLI::Range(1, 1 << 20))
      ->type_name("N");
}

void AddReading(CLI::App& load, LoadFlags& flags) {
  load.add_option("--request-timeout", flags.request_timeout_s, "Deadline [s] (default: 60)")
      ->check(CLI::Range(0.001, 86400.0))
      ->check(FiniteNumber())
      ->type_name("S");
  load.add_option("--viewers", flags.plan.viewers, "That follow clients and read all their frames")
      ->check(CLI::Range(0, static_cast<int>(kMaxClients)))
      ->type_name("N");
  load.add_option("--viewer-hz", flags.plan.viewer_hz, "Frames per second of each (default: 50)")
      ->check(CLI::Range(0.0, 1e6))
      ->check(FiniteNumber())
      ->type_name("HZ");
  load.add_option("--stalled-viewers", flags.plan.stalled_viewers,
                  "That subscribe and never read a frame")
      ->check(CLI::Range(0, static_cast<int>(kMaxClients)))
      ->type_name("N");
  load.add_option("--percentile", flags.percent,
                  "A further percentile; also of stability and threshold (default: the median)")
      ->check(CLI::Range(1e-3, 100.0))
      ->check(FiniteNumber())
      ->type_name("PERCENT");
  load.add_option("-l,--latency-threshold", flags.latency_threshold_ms,
                  "The first level that is slower is the last (default: none)")
      ->check(CLI::Range(0.0, 1e9))
      ->check(FiniteNumber())
      ->type_name("MS");
  load.add_option("-f,--csv", flags.csv, "Write a line per level")->type_name("FILE.csv");
  load.add_flag("--json", flags.is_json, "Print JSON");
}

}  // namespace

void AddLoad(CLI::App& app, Action& action) {
  CLI::App* load = app.add_subcommand(
      "load", "Measure latency and throughput of many clients; flags are those of perf_analyzer");
  auto flags = std::make_shared<LoadFlags>();
  flags->server.AddTo(*load);
  AddScene(*load, *flags);
  AddLevels(*load, *flags);
  AddReading(*load, *flags);
  load->callback([flags, &action] { action = [flags] { return Load(*flags); }; });
}

}  // namespace drape::cli
