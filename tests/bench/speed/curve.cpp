// Time against strain: many cloths that hang by two corners, each under its own gravity.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <thread>

#include "server/core/check.h"
#include "server/solver/cpu/cpu_backend.h"
#include "tests/bench/accuracy/bullet_cloth.h"
#include "tests/bench/accuracy/deviations.h"
#include "tests/bench/bench_scenes.h"
#include "tests/bench/speed/curve_settings.h"
#include "tests/bench/speed/speed.h"
#include "tests/support/states.h"

namespace drape::bench {
namespace {

using Clock = std::chrono::steady_clock;

const std::vector<std::string> kColumns = {
    "program",   "family",        "method",         "settings",   "status",     "cloths",
    "particles", "us_one_thread", "us_all_threads", "iterations", "max_strain", "rms_strain"};

// All cloths of one contestant, stepped together.
class Crowd {
 public:
  virtual ~Crowd() = default;
  virtual FrameReport Step() = 0;  // sweeps of one cloth, whether any is faulted
  virtual ParticleState State(size_t cloth) = 0;
};

class BackendCrowd final : public Crowd {
 public:
  BackendCrowd(Backend& backend, std::span<const AccuracyScene> cloths) : backend_(backend) {
    for (const AccuracyScene& cloth : cloths) {
      items_.push_back({test::CreateCloth(backend, cloth.scene), {}, false});
    }
  }
  ~BackendCrowd() override {
    for (const StepItem& item : items_) backend_.Destroy(item.cloth);
  }
  BackendCrowd(const BackendCrowd&) = delete;
  BackendCrowd& operator=(const BackendCrowd&) = delete;

  FrameReport Step() override {
    FrameReport frame;
    for (const StepReport& report : backend_.Step(items_).reports) {
      frame.iterations += report.iterations;
      frame.is_faulted |= report.fault != FaultReason::kNone;
    }
    frame.iterations /= static_cast<uint32_t>(items_.size());
    return frame;
  }
  ParticleState State(size_t cloth) override {
    return test::ReadState(backend_, items_[cloth].cloth);
  }

 private:
  Backend& backend_;
  std::vector<StepItem> items_;
};

class BulletCrowd final : public Crowd {
 public:
  BulletCrowd(std::span<const AccuracyScene> cloths, const BulletSettings& settings) {
    for (const AccuracyScene& cloth : cloths) {
      cloths_.push_back(MakeBulletCloth(cloth.scene, settings));
      cloths_.back()->Restart();
    }
  }
  FrameReport Step() override {
    FrameReport frame;
    for (const auto& cloth : cloths_) frame = cloth->Step();
    return frame;
  }
  ParticleState State(size_t cloth) override { return cloths_[cloth]->State(); }

 private:
  std::vector<std::unique_ptr<Contestant>> cloths_;
};

struct CurvePoint {
  std::string status = "ok";  // as of PlayResult
  double us_one_thread = std::nan("");
  double us_all_threads = std::nan("");  // wall time of a frame / cloths
  double iterations = 0;
  double max_strain = std::nan("");
  double rms_strain = std::nan("");
};

double TimedStep_us(Crowd& crowd, FrameReport& report) {
  const auto start = Clock::now();
  report = crowd.Step();
  return std::chrono::duration<double, std::micro>(Clock::now() - start).count();
}

// One whole play: mean time of a frame, and the strain in its last part, over all cloths.
CurvePoint Play(Crowd& crowd, std::span<const AccuracyScene> cloths, const CurveOptions& options) {
  CurvePoint point;
  const std::vector<Eigen::Vector3d> no_reference;
  std::vector<Observer> observers;
  for (const AccuracyScene& cloth : cloths) observers.emplace_back(cloth, no_reference);
  double sum_us = 0;
  for (uint32_t frame = 1; frame <= options.frames; ++frame) {
    FrameReport report;
    sum_us += TimedStep_us(crowd, report);
    point.iterations += static_cast<double>(report.iterations) / options.frames;
    point.us_all_threads = sum_us / frame / static_cast<double>(cloths.size());
    if (report.is_faulted) point.status = "faulted";
    if (sum_us / frame * options.frames > 1e6 * options.play_s) point.status = "over_time";
    if (point.status != "ok") return point;
    if (frame <= options.frames - options.window_frames) continue;
    for (size_t k = 0; k < cloths.size(); ++k) observers[k].Observe(frame, crowd.State(k));
  }
  double max = 0;
  double sum_sq = 0;
  for (const Observer& observer : observers) {
    const Deviations deviations = observer.Result();
    max = std::max(max, deviations.max_strain);
    sum_sq += deviations.rms_strain * deviations.rms_strain;
  }
  point.max_strain = max;
  point.rms_strain = std::sqrt(sum_sq / static_cast<double>(cloths.size()));
  if (!std::isfinite(point.rms_strain)) point.status = "faulted";
  return point;
}

// Mean time of a frame per cloth, from the start on.
double TimeFrames_us(Crowd& crowd, const CurveOptions& options) {
  double sum_us = 0;
  uint32_t frames = 0;
  while (frames < options.frames && sum_us < 1e6 * options.thread_s) {
    FrameReport report;
    sum_us += TimedStep_us(crowd, report);
    ++frames;
  }
  return sum_us / frames / options.cloths;
}

std::vector<AccuracyScene> HangingCloths(const CurveOptions& options,
                                         const StepSettings& settings) {
  const ClothBatch batch =
      MakeBatch(Sheet(options.side * options.side, Pins::kCorners, settings), options.cloths);
  AccuracyScene cloth{.name = "hanging", .title = "", .scene = batch.scene};
  cloth.duration_s = options.frames * kFrame_s;
  cloth.window_start_s = cloth.duration_s - (options.window_frames - 1) * kFrame_s;
  std::vector<AccuracyScene> cloths;
  for (const Eigen::Vector3d& gravity_m_per_s2 : batch.gravities_m_per_s2) {
    cloth.scene.parameters.gravity_m_per_s2 = gravity_m_per_s2;
    cloths.push_back(cloth);
  }
  return cloths;
}

void AddRow(Table& table, const CurveOptions& options, const std::string& program,
            const Method& method, const std::string& settings, const CurvePoint& point) {
  std::printf("    %-7s %-30s %8.1f us, all threads %8.1f us  strain %.2g %.2g  %s\n",
              program.c_str(), method.name.c_str(), point.us_one_thread, point.us_all_threads,
              point.max_strain, point.rms_strain, point.status.c_str());
  table.Add({program, method.family, method.name, settings, point.status, options.cloths,
             options.side * options.side, point.us_one_thread, point.us_all_threads,
             point.iterations, point.max_strain, point.rms_strain});
}

// The backend cpu with all threads and with one.
void PlayMethod(Table& table, const CurveOptions& options, const Method& method, Backend& all,
                Backend& one) {
  const std::vector<AccuracyScene> cloths = HangingCloths(options, method.settings);
  BackendCrowd together(all, cloths);
  CurvePoint point = Play(together, cloths, options);
  if (point.status == "ok") {
    BackendCrowd alone(one, cloths);
    point.us_one_thread = TimeFrames_us(alone, options);
  }
  AddRow(table, options, "cpu", method, SettingsText(cloths[0].scene.parameters.settings), point);
}

// On one thread, as Bullet's soft body is.
bool PlayPeer(Bench& bench, Table& table, const CurveOptions& options) {
  std::vector<BulletSettings> all = {{1, 10}, {1, 50}, {4, 4}, {16, 1}, {60, 1}};
  if (bench.is_quick()) all = {{1, 10}};
  const std::vector<AccuracyScene> cloths =
      HangingCloths(options, PresetSettings(Preset::kRealtime));
  for (const BulletSettings& settings : all) {
    const std::string sizes =
        std::to_string(settings.substeps) + "x" + std::to_string(settings.iterations);
    if (!bench.StartRow("Bullet " + sizes)) return false;
    BulletCrowd crowd(cloths, settings);
    CurvePoint point = Play(crowd, cloths, options);
    point.us_one_thread = point.us_all_threads;
    point.us_all_threads = std::nan("");
    AddRow(table, options, "bullet", {"Bullet", "Bullet " + sizes, {}},
           "steps=" + std::to_string(settings.substeps) +
               " piterations=" + std::to_string(settings.iterations),
           point);
  }
  return true;
}

}  // namespace

void MeasureCurve(Bench& bench, CurveOptions options) {
  std::vector<Method> methods = CurveMethods();
  if (bench.is_quick()) {
    options.cloths = 3;
    options.side = 8;
    options.frames = 6;
    options.window_frames = 3;
    methods.resize(4);
  }
  for (const std::string& text : options.methods) methods.push_back(ParseMethod(text));
  Table table = bench.OpenTable("speed_curve", kColumns);
  const std::unique_ptr<Backend> all = CreateCpuBackend();
  const std::unique_ptr<Backend> one = CreateCpuBackend({.thread_count = 1});
  for (const Method& method : methods) {
    if (!bench.StartRow(method.name)) return;
    PlayMethod(table, options, method, *all, *one);
  }
  PlayPeer(bench, table, options);
}

}  // namespace drape::bench
