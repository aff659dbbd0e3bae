#include "client/cli/load_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numeric>
#include <utility>

namespace drape::cli {
namespace {

constexpr size_t kStableWindows = 3;

double Mean(std::span<const double> values) {
  if (values.empty()) return 0;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

bool AreNear(std::span<const double> values, double tolerance_percent) {
  const double mean = Mean(values);
  return std::all_of(values.begin(), values.end(), [&](double value) {
    return value > 0 && std::abs(value - mean) <= tolerance_percent / 100 * mean;
  });
}

double PerSecond(uint64_t count, const LoadSamples& samples) {
  return samples.wall_s > 0 ? static_cast<double>(count) / samples.wall_s : 0;
}

// "p95_ms", "p99.9_ms"
std::string PercentileName(double percent) {
  char name[32];
  std::snprintf(name, sizeof name, "p%g_ms", percent);
  return name;
}

// The numeric columns, in order. The errors are the last column, which is text.
std::vector<std::pair<std::string, double>> Columns(const LoadRow& row, double percent) {
  const LoadSamples& all = row.samples;
  const std::span<const double> latencies(all.latencies_ms);
  const auto count = static_cast<double>(std::max<size_t>(1, latencies.size()));
  const auto mean_ms = [&](uint64_t sum_us) { return static_cast<double>(sum_us) * 1e-3 / count; };
  std::vector<std::pair<std::string, double>> columns = {
      {"concurrency", row.level.clients},
      {"request_rate_per_s", row.level.rate_per_s},
      {"requests", static_cast<double>(latencies.size())},
      {"requests_per_s", PerSecond(latencies.size(), all)},
      {"cloth_steps_per_s", PerSecond(all.cloth_steps, all)},
      {"mean_ms", Mean(latencies)},
      {"p50_ms", Percentile(latencies, 50)},
      {"p90_ms", Percentile(latencies, 90)},
      {"p95_ms", Percentile(latencies, 95)},
      {"p99_ms", Percentile(latencies, 99)},
      {"max_ms", Percentile(latencies, 100)}};
  if (percent > 0) columns.emplace_back(PercentileName(percent), Percentile(latencies, percent));
  const std::vector<std::pair<std::string, double>> rest = {
      {"queue_ms", mean_ms(all.queue_us)},
      {"upload_ms", mean_ms(all.upload_us)},
      {"device_ms", mean_ms(all.device_us)},
      {"readback_ms", mean_ms(all.readback_us)},
      {"encode_ms", mean_ms(all.encode_us)},
      {"delayed", static_cast<double>(all.delayed)},
      {"failed", static_cast<double>(all.error_count())},
      {"frames_per_s", PerSecond(all.frame_ages_ms.size(), all)},
      {"frame_age_p50_ms", Percentile(all.frame_ages_ms, 50)},
      {"frame_age_p95_ms", Percentile(all.frame_ages_ms, 95)},
      {"frames_dropped", static_cast<double>(all.frames_dropped)},
      {"is_stable", row.is_stable ? 1.0 : 0.0}};
  columns.insert(columns.end(), rest.begin(), rest.end());
  return columns;
}

// "QUEUE_FULL=12;DEADLINE_EXCEEDED=1"
std::string ErrorsText(const LoadSamples& samples) {
  std::string text;
  for (const auto& [reason, count] : samples.errors) {
    text += (text.empty() ? "" : ";") + reason + "=" + std::to_string(count);
  }
  return text;
}

}  // namespace

void LoadSamples::Add(const LoadSamples& other) {
  latencies_ms.insert(latencies_ms.end(), other.latencies_ms.begin(), other.latencies_ms.end());
  delayed += other.delayed;
  for (const auto& [reason, count] : other.errors) errors[reason] += count;
  wall_s += other.wall_s;
  cloth_steps += other.cloth_steps;
  queue_us += other.queue_us;
  upload_us += other.upload_us;
  device_us += other.device_us;
  readback_us += other.readback_us;
  encode_us += other.encode_us;
  frame_ages_ms.insert(frame_ages_ms.end(), other.frame_ages_ms.begin(), other.frame_ages_ms.end());
  frames_dropped += other.frames_dropped;
}

uint64_t LoadSamples::error_count() const {
  return std::accumulate(errors.begin(), errors.end(), uint64_t{0},
                         [](uint64_t sum, const auto& error) { return sum + error.second; });
}

double Percentile(std::span<const double> values, double percent) {
  if (values.empty()) return 0;
  std::vector<double> ordered(values.begin(), values.end());
  const double wanted = std::ceil(percent / 100 * static_cast<double>(ordered.size()) - 1e-9);
  const auto rank = static_cast<size_t>(std::max(1.0, wanted)) - 1;
  const auto place =
      ordered.begin() + static_cast<std::ptrdiff_t>(std::min(rank, ordered.size() - 1));
  std::nth_element(ordered.begin(), place, ordered.end());
  return *place;
}

bool IsStable(std::span<const LoadSamples> windows, double percent, double tolerance_percent) {
  if (windows.size() < kStableWindows) return false;
  std::vector<double> rates, latencies;
  for (const LoadSamples& window : windows.last(kStableWindows)) {
    rates.push_back(PerSecond(window.latencies_ms.size(), window));
    latencies.push_back(Percentile(window.latencies_ms, percent));
  }
  return AreNear(rates, tolerance_percent) && AreNear(latencies, tolerance_percent);
}

std::string LoadCsvHeader(double percent) {
  std::string line;
  for (const auto& [name, value] : Columns({}, percent)) line += name + ",";
  return line + "errors\n";
}

std::string LoadCsvLine(const LoadRow& row, double percent) {
  std::string line;
  for (const auto& [name, value] : Columns(row, percent)) {
    char cell[32];
    std::snprintf(cell, sizeof cell, "%.6g,", value);
    line += cell;
  }
  return line + ErrorsText(row.samples) + "\n";
}

std::string LoadJson(const std::vector<LoadRow>& rows, double percent) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const LoadRow& row : rows) {
    nlohmann::ordered_json& object = json.emplace_back();
    for (const auto& [name, value] : Columns(row, percent)) object[name] = value;
    object["errors"] = row.samples.errors;
  }
  return json.dump(1) + "\n";
}

std::string LoadTable(const std::vector<LoadRow>& rows, double percent) {
  std::string text;
  for (const LoadRow& row : rows) {
    const LoadSamples& all = row.samples;
    const std::span<const double> latencies(all.latencies_ms);
    char line[512];
    if (row.level.rate_per_s > 0) {
      std::snprintf(line, sizeof line, "rate %g/s, %u clients", row.level.rate_per_s,
                    row.level.clients);
    } else {
      std::snprintf(line, sizeof line, "concurrency %u", row.level.clients);
    }
    text += line;
    std::snprintf(line, sizeof line,
                  ": %.1f requests/s, %.1f cloth steps/s%s\n  latency [ms]: mean %.3f, p50 %.3f, "
                  "p90 %.3f, p95 %.3f, p99 %.3f, max %.3f",
                  PerSecond(latencies.size(), all), PerSecond(all.cloth_steps, all),
                  row.is_stable ? "" : " (not stable)", Mean(latencies), Percentile(latencies, 50),
                  Percentile(latencies, 90), Percentile(latencies, 95), Percentile(latencies, 99),
                  Percentile(latencies, 100));
    text += line;
    if (percent > 0) {
      std::snprintf(line, sizeof line, ", p%g %.3f", percent, Percentile(latencies, percent));
      text += line;
    }
    text += "\n";
    if (!all.frame_ages_ms.empty()) {
      std::snprintf(line, sizeof line, "  viewers: %.1f frames/s, age p50 %.2f ms, p95 %.2f ms\n",
                    PerSecond(all.frame_ages_ms.size(), all), Percentile(all.frame_ages_ms, 50),
                    Percentile(all.frame_ages_ms, 95));
      text += line;
    }
    if (all.delayed > 0) {
      text +=
          "  delayed or not sent, because every client was busy: " + std::to_string(all.delayed) +
          "\n";
    }
    if (!all.errors.empty()) text += "  failed: " + ErrorsText(all) + "\n";
  }
  return text;
}

}  // namespace drape::cli
