#include "server/solver/cpu/long_step.h"

#include <tbb/parallel_for.h>

#include <atomic>
#include <utility>

#include "server/solver/cpu/cpu_cloth.h"
#include "server/solver/cpu/simd/denormals.h"
#include "server/solver/cpu/world.h"
#include "server/solver/self_contact/self_contacts.h"
#include "server/solver/surface_contact/surface_contacts.h"

namespace drape::cpu {
namespace {

// Of StepScratch, for each particle, about: 20 vectors.
constexpr uint64_t kScratchBytes = 320;
// The same for each particle and collider.
constexpr uint64_t kContactBytes = sizeof(ContactImpulses) + Clearances::kNumbers * sizeof(float);

}  // namespace

LongStep::LongStep(std::vector<Cloth*> cloths, int thread_count, MakeStepped make_stepped)
    : cloths_(std::move(cloths)),
      thread_count_(thread_count),
      make_stepped_(std::move(make_stepped)),
      scratches_(cloths_.size()) {
  work_ = PausableWork::Begin([this](Interruption& interruption, const Pause& pause) {
    while (!ContinueStages(pause, &interruption)) interruption.Check();
  });
}

bool LongStep::ContinueStages(const Pause& pause, Interruption* interruption) {
  const DenormalsAreZero denormals_are_zero;
  std::vector<StepScratch*> scratches;
  for (StepScratch& scratch : scratches_) scratches.push_back(&scratch);
  is_within_stage_ = true;
  std::vector<SteppedCloth> stepped =
      make_stepped_(cloths_, items_, *team_, scratches, interruption);
  bool is_over = true;
  if (cloths_[0]->fault == FaultReason::kNone) {
    is_over = ContinueStep(stepped, progress_, pause);
  } else {
    std::vector<StepReport> reports(cloths_.size());
    MeasureFaulted(cloths_, stepped, reports);
    for (StepReport& report : reports) progress_.cloths.push_back({.report = std::move(report)});
  }
  is_within_stage_ = false;
  return is_over;
}

// One thread leads, the others help.
bool LongStep::Continue(std::span<const StepItem> items, tbb::task_arena& arena,
                        const Pause& pause) {
  items_ = items;
  if (!is_within_stage_) {
    const bool has_team = LargestOf(cloths_) >= kMinTeamParticles;
    team_ = std::make_unique<StepTeam>(has_team ? static_cast<uint32_t>(thread_count_) : 1);
  }
  bool is_over = false;
  std::atomic<bool> has_leader{false};
  const auto work = [&](const tbb::blocked_range<size_t>&) {
    if (has_leader.exchange(true)) {
      const DenormalsAreZero denormals_are_zero;
      return team_->Join();
    }
    const TeamLead lead{team_.get()};
    is_over = work_ ? work_->Continue(pause) : ContinueStages(pause, nullptr);
  };
  arena.execute([&] {
    tbb::parallel_for(tbb::blocked_range<size_t>(0, team_->max_members(), 1), work,
                      tbb::simple_partitioner());
  });
  return is_over;
}

std::vector<StepReport> LongStep::reports() const {
  std::vector<StepReport> reports;
  for (const StepOfCloth& its : progress_.cloths) reports.push_back(its.report);
  return reports;
}

uint64_t LongStepBytes(std::span<Cloth* const> cloths) {
  size_t particles = 0, contacts = 0, on_edges = 0;
  for (const Cloth* const cloth : cloths) {
    const size_t pairs = cloth->model->particle_count * cloth->parameters.colliders.size();
    particles += cloth->model->particle_count;
    contacts += pairs;
    if (cloth->surface_parts != nullptr) on_edges += pairs;
  }
  const bool may_touch = cloths.size() > 1 || cloths[0]->contact_surface != nullptr;
  return kScratchBytes * particles + kContactBytes * contacts +
         surface_contact::MostBytes<self_contact::Vector3f>(on_edges) +
         (may_touch ? self_contact::MostBytes<self_contact::Vector3f>(particles) : 0);
}

}  // namespace drape::cpu
