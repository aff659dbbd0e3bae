// R.json: the results of a run, with fixed field names.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "drape/scene_player.h"
#include "drape/v1/simulation_service.pb.h"
#include "drape/v1/step.pb.h"

namespace drape::cli {

// What a cloth gave to its colliders and pins in the step of a sample.
struct SampleImpulses {
  using Vector = std::array<double, 3>;
  struct OfCollider {
    Vector impulse_n_s, angular_impulse_n_m_s;
  };
  struct OfPin {
    uint32_t particle = 0;
    Vector impulse_n_s;
  };

  std::vector<OfCollider> colliders;
  std::vector<OfPin> pins;
};

// Everything known about one cloth of a run.
struct ClothReport {
  ClothId id = 0;
  v1::ClothShape shape;
  std::vector<v1::StepReport> samples;
  std::vector<std::optional<SampleImpulses>> impulses;  // of each sample; unset: not asked for
  // The first sample after a fault, with its reason and the last step that the cloth completed.
  std::optional<v1::StepReport> fault;
};

// A run in numbers; grows sample by sample.
class RunReport {
 public:
  RunReport(const v1::ServerInfo& server, const ScenePlayer& player);

  // Adds `steps` steps; the reports describe the last of them.
  void Add(uint64_t steps, const AdvanceResult& result);

  const std::string& scene() const { return scene_; }
  const std::string& backend() const { return backend_; }
  const std::string& device() const { return device_; }
  uint64_t steps() const { return steps_; }
  double time_step_s() const { return time_step_s_; }
  // Time that the client waited for Step answers, and that of the device; 0 without steps.
  double wall_ms_per_step() const;
  double device_ms_per_step() const;
  const std::vector<ClothReport>& cloths() const { return cloths_; }

 private:
  void AddImpulses(const AdvanceResult& result);

  std::string scene_;
  std::string backend_;
  std::string device_;
  double time_step_s_;
  uint64_t steps_ = 0;
  double wait_s_ = 0;
  uint64_t device_us_ = 0;
  std::vector<ClothReport> cloths_;
};

// The file of the command line contract: every field always written, counters as numbers, ids as
// decimal strings. The step of a sample is that of the run, also for a cloth that has stopped with
// a fault; its time is that times the time step.
std::string ReportJson(const RunReport& report);

// For people: a line per cloth whose mesh was repaired, whose edges were let out, or of which some
// bending or shear is softer than requested.
std::string ImportLines(const RunReport& report);

// A line per faulted cloth, for people: its index in the scene, its last good step, and why.
std::string FaultLines(const RunReport& report);

// A run on one line.
struct RunSummary {
  uint64_t cloths = 0;
  uint64_t particles = 0;
  uint64_t constraints = 0;  // distance constraints
  uint32_t colours = 0;      // the most of any cloth
  double ms_per_step = 0;
  double real_time_factor = 0;  // simulated time / time waited; 0 without steps
  double max_strain = 0;        // largest of any sample
  double rms_strain = 0;        // at the end, over all constraints
  uint64_t contacts = 0;        // at the end
  uint64_t faulted = 0;         // cloths
};

RunSummary Summarise(const RunReport& report);

// A table with one row per run, for people.
std::string SummaryTable(const std::vector<RunReport>& reports);

}  // namespace drape::cli
