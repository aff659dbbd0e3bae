#include "tests/bench/contact/contact.h"

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <numeric>

#include "server/solver/cpu/cpu_backend.h"
#include "tests/bench/contact/contact_scenes.h"
#include "tests/bench/quantiles.h"

namespace drape::bench {
namespace {

// Of the calling thread, or of a clock.
double Time_ms(bool of_thread) {
  timespec time{};
  clock_gettime(of_thread ? CLOCK_THREAD_CPUTIME_ID : CLOCK_MONOTONIC, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

// Cloths that play one scene.
class ContactPlayer {
 public:
  ContactPlayer(Backend& backend, uint32_t threads, ContactPlay play, uint32_t cloths,
                bool touches_itself)
      : backend_(backend), has_one_thread_(threads == 1), play_(std::move(play)) {
    if (!touches_itself) play_.scene.parameters.self_collision.reset();
    gravities_ = MakeBatch(play_.scene, cloths).gravities_m_per_s2;
    if (cloths == 1) gravities_ = {play_.scene.parameters.gravity_m_per_s2};
    for (const Eigen::Vector3d& gravity : gravities_) {
      items_.push_back({test::CreateCloth(backend, With(gravity)), {}, false});
    }
  }
  ~ContactPlayer() {
    for (const StepItem& item : items_) backend_.Destroy(item.cloth);
  }
  ContactPlayer(const ContactPlayer&) = delete;
  ContactPlayer& operator=(const ContactPlayer&) = delete;

  // The time of the step [ms].
  double Step(uint32_t frame, bool measure) {
    if (play_.change(frame, play_.scene)) {
      for (size_t k = 0; k < items_.size(); ++k) {
        ClothUpdate update;
        update.parameters = With(gravities_[k]).parameters;
        (void)backend_.Write(items_[k].cloth, update);
      }
    }
    for (StepItem& item : items_) {
      item.pin_targets_m = play_.scene.pin_targets_m;
      item.measure = measure;
    }
    const double start_ms = Time_ms(has_one_thread_);
    reports_ = backend_.Step(items_).reports;
    return Time_ms(has_one_thread_) - start_ms;
  }
  const std::vector<StepReport>& reports() const { return reports_; }

 private:
  test::Scene With(const Eigen::Vector3d& gravity) const {
    test::Scene scene = play_.scene;
    scene.parameters.gravity_m_per_s2 = gravity;
    return scene;
  }

  Backend& backend_;
  const bool has_one_thread_;
  ContactPlay play_;
  std::vector<Eigen::Vector3d> gravities_;
  std::vector<StepItem> items_;
  std::vector<StepReport> reports_;
};

struct Kept {
  uint64_t near_pairs = 0;  // over all cloths
  uint64_t crossings = 0;
  double max_strain = 0;
  double p99_strain = 0;  // largest of a cloth
  uint32_t faulted = 0;
};

Kept KeptIn(const std::vector<StepReport>& reports) {
  Kept kept;
  for (const StepReport& report : reports) {
    kept.near_pairs += report.measured.near_pairs;
    kept.crossings += report.measured.crossings;
    kept.max_strain = std::max(kept.max_strain, report.measured.max_strain);
    kept.p99_strain = std::max(kept.p99_strain, report.measured.strain_p99);
    kept.faulted += report.fault != FaultReason::kNone;
  }
  return kept;
}

double Mean(std::span<const double> values) {
  if (values.empty()) return 0;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

class ContactTables {
 public:
  ContactTables(Bench& bench, uint32_t threads)
      : threads_(threads),
        summary_(bench.OpenTable(
            "contact", {"scene", "side", "cloths", "substeps", "thickness_mm", "mean_ms",
                        "worst_ms", "bare_mean_ms", "touching_mean_ms", "frames_with_crossings",
                        "max_strain", "strain_p99", "most_near_pairs", "faulted"})),
        frames_(bench.OpenTable("contact_frames",
                                {"scene", "side", "cloths", "substeps", "frame", "ms", "bare_ms",
                                 "near_pairs", "crossings", "max_strain"})) {}

  // Times are of cloths that nobody measures; equal cloths on a second backend are measured.
  void Play(const ContactPlay& play, const ContactPlayOptions& options, uint32_t cloths) {
    const auto backend = CreateCpuBackend({.thread_count = threads_});
    ContactPlayer touching(*backend, threads_, play, cloths, true),
        bare(*backend, threads_, play, cloths, false),
        measured(*backend, threads_, play, cloths, true);
    std::vector<double> times_ms, bare_ms, touching_ms;
    Kept worst;
    uint32_t crossed = 0;
    for (uint32_t frame = 0; frame < play.frames; ++frame) {
      bare_ms.push_back(bare.Step(frame, false));
      times_ms.push_back(touching.Step(frame, false));
      measured.Step(frame, true);
      const Kept kept = KeptIn(measured.reports());
      if (kept.near_pairs > 0) touching_ms.push_back(times_ms.back());
      crossed += kept.crossings > 0;
      worst.near_pairs = std::max(worst.near_pairs, kept.near_pairs);
      worst.max_strain = std::max(worst.max_strain, kept.max_strain);
      worst.p99_strain = std::max(worst.p99_strain, kept.p99_strain);
      worst.faulted = std::max(worst.faulted, kept.faulted);
      frames_.Add({play.name, options.side, cloths, options.substeps, frame, times_ms.back(),
                   bare_ms.back(), kept.near_pairs, kept.crossings, kept.max_strain});
    }
    const double worst_ms = Quantile(times_ms, 1);
    summary_.Add({play.name, options.side, cloths, options.substeps, 1e3 * options.thickness_m,
                  Mean(times_ms), worst_ms, Mean(bare_ms), Mean(touching_ms), crossed,
                  worst.max_strain, worst.p99_strain, worst.near_pairs, worst.faulted});
    std::printf(
        "    %-8s %2u x %-2u %2u cloths: %7.2f ms, worst %7.2f, bare %7.2f, ratio %5.2f; %u frames "
        "with a crossing, strain %.2f %% (p99 %.2f), %llu pairs\n",
        play.name.c_str(), options.side, options.side, cloths, Mean(times_ms), worst_ms,
        Mean(bare_ms), Mean(times_ms) / Mean(bare_ms), crossed, 100 * worst.max_strain,
        100 * worst.p99_strain, static_cast<unsigned long long>(worst.near_pairs));
  }

 private:
  const uint32_t threads_;
  Table summary_, frames_;
};

}  // namespace

void MeasureContact(Bench& bench, ContactOptions options) {
  if (bench.is_quick()) {
    options.sides = {8};
    options.counts = {1, 2};
    options.substeps = {5};
  }
  ContactTables tables(bench, options.threads);
  for (const uint32_t count : options.counts) {
    for (const uint32_t side : options.sides) {
      if (count > 1 && side != options.sides.front()) continue;
      for (const uint32_t substeps : options.substeps) {
        const ContactPlayOptions play_options{side, substeps, options.thickness_m};
        for (const ContactPlay& play : ContactPlays(play_options)) {
          const auto& wanted = options.scenes;
          if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), play.name) == wanted.end())
            continue;
          if (!bench.StartRow(play.name + ", " + std::to_string(count) + " cloths")) return;
          tables.Play(play, play_options, count);
        }
      }
    }
  }
}

}  // namespace drape::bench
