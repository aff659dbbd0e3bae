#include "server/solver/cpu/cpu_backend.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/partitioner.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <deque>
#include <memory>
#include <new>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/solver/cpu/alone/cloth_step.h"
#include "server/solver/cpu/alone/self_contacts.h"
#include "server/solver/cpu/arithmetic.h"
#include "server/solver/cpu/cloth_slots.h"
#include "server/solver/cpu/cpu_cloth.h"
#include "server/solver/cpu/long_step.h"
#include "server/solver/cpu/model/float_model.h"
#include "server/solver/cpu/side_by_side/group_step.h"
#include "server/solver/cpu/simd/denormals.h"
#include "server/solver/cpu/step/find_reach.h"
#include "server/solver/cpu/step/step_team.h"
#include "server/solver/cpu/step_groups.h"
#include "server/solver/cpu/world.h"
#include "server/solver/drop_when_due.h"
#include "server/solver/self_contact/contact_surface.h"
#include "server/solver/self_contact/self_contacts.h"
#include "server/solver/update_check.h"

namespace drape {
namespace cpu {
namespace {

Status OutOfMemory() {
  return {StatusCode::kResourceExhausted, "DEVICE_MEMORY",
          "the server has no memory left for this cloth"};
}

class CpuBackend final : public Backend {
 public:
  CpuBackend(const CpuBackendOptions& options, const CpuBackendTesting& testing)
      : thread_count_(options.thread_count > 0 ? static_cast<int>(options.thread_count)
                                               : tbb::info::default_concurrency()),
        arena_(thread_count_),
        lane_count_(testing.use_lanes ? SupportedLanes().lane_count : 1),
        leaves_out_colliders_(testing.leave_out_colliders),
        scratch_(static_cast<size_t>(thread_count_)) {
    // Now, not with the first step: oneTBB ends the process where it has no memory to begin with.
    arena_.initialize();
  }

  BackendDescription Describe() const override {
    return {
        .name = "cpu",
        .device = std::to_string(thread_count_) + (thread_count_ == 1 ? " core, " : " cores, ") +
                  arithmetic_,
        .arithmetic = arithmetic_,
        .scalar = ScalarType::kFloat32,
        .has_cheap_impulses = true,
        .plan_of = [plan = lane_count_ > 1 ? "lanes" : "single"](
                       const SceneModel&, const ClothParameters&) { return plan; },
        .make_shared_parts =
            [made = made_](const auto& model, const auto& parameters, Interruption* interruption) {
              return made->ForCloth(model, parameters, interruption);
            }};
  }

  Result<ClothHandle> Create(std::shared_ptr<const SceneModel> model,
                             const ClothParameters& parameters, const ParticleState& state) override
      try {
    DRAPE_RETURN_IF_ERROR(CheckStateFits(*model, parameters, state));
    Cloth cloth;
    cloth.model = made_->models.Get(model);
    cloth.parameters = parameters;
    SetScheme(cloth);
    SetSurfaces(cloth, *made_);
    cloth.state = ToFloat(state, cloth.model->particle_count);
    for (const uint32_t pin : cloth.model->pins) {
      cloth.pin_targets.push_back(cloth.state.positions[pin]);
    }
    return cloths_.Add(std::move(cloth));
  } catch (const std::bad_alloc&) {
    return OutOfMemory();
  }

  void Destroy(ClothHandle cloth) override {
    Abandon(cloths_.At(cloth));
    cloths_.Remove(cloth);
  }

  BatchReport Step(std::span<const StepItem> items) override {
    return StepUntil(items, Pause::Never());
  }

  BatchReport StepUntil(std::span<const StepItem> items, const Pause& pause) override {
    const auto start = std::chrono::steady_clock::now();
    BatchReport batch{.reports = std::vector<StepReport>(items.size())};
    StepOnAllThreads(items, pause, batch.reports);
    batch.device_us = std::lround(UsSince(start));
    return batch;
  }

  std::optional<BatchReport> StepPiece(std::span<const StepItem> items,
                                       const Pause& pause) override {
    const auto start = std::chrono::steady_clock::now();
    const std::vector<Cloth*> cloths = ClothsOf(items);
    if (cloths[0]->long_step == nullptr || cloths[0]->long_step->cloths() != cloths) {
      const bool is_faulted = cloths[0]->fault != FaultReason::kNone;
      for (size_t k = 0; k < cloths.size(); ++k) {
        is_faulted ? Abandon(*cloths[k]) : SetTargets(*cloths[k], items[k]);
      }
      const auto begun = std::make_shared<LongStep>(
          cloths, thread_count_, [this](auto&&... how) { return SteppedOf(how...); });
      for (Cloth* const cloth : cloths) cloth->long_step = begun;
    }
    const std::shared_ptr<LongStep> step = cloths[0]->long_step;
    const bool was_faulted = cloths[0]->fault != FaultReason::kNone;
    if (!step->Continue(items, arena_, pause)) return std::nullopt;
    BatchReport batch{.reports = step->reports()};
    for (size_t k = 0; k < cloths.size(); ++k) {
      cloths[k]->long_step = nullptr;
      if (was_faulted) continue;
      EndSelfContacts(*cloths[k], batch.reports[k], step->scratch(k));
      EndStep(*cloths[k], batch.reports[k]);
    }
    batch.device_us = std::lround(UsSince(start));
    return batch;
  }

  uint64_t LongStepBytes(std::span<const ClothHandle> cloths) override {
    std::vector<Cloth*> its;
    for (const ClothHandle handle : cloths) its.push_back(&cloths_.At(handle));
    return cpu::LongStepBytes(its);
  }

  void AbandonStep(ClothHandle cloth) override { Abandon(cloths_.At(cloth)); }

  StateColumns Read(const ReadRequest& request) override {
    const std::span<const uint32_t> particles = request.particles;
    size_t rows = 0;
    for (const ClothHandle& handle : request.cloths) {
      rows += RowsOf(particles, cloths_.At(handle).model->particle_count);
    }
    std::vector<float> positions, velocities;
    if (request.positions) positions.reserve(3 * rows);
    if (request.velocities) velocities.reserve(3 * rows);
    for (const ClothHandle& handle : request.cloths) {
      const Cloth& cloth = cloths_.At(handle);
      const uint32_t count = cloth.model->particle_count;
      if (request.positions) Append(cloth.state.positions, count, particles, positions);
      if (request.velocities) Append(cloth.state.velocities, count, particles, velocities);
    }
    return {std::move(positions), std::move(velocities)};
  }

  bool MayCrossItself(ClothHandle handle) override { return cloths_.At(handle).may_cross_itself; }

  Status Write(ClothHandle handle, const ClothUpdate& update) override try {
    Cloth& cloth = cloths_.At(handle);
    Abandon(cloth);
    DRAPE_RETURN_IF_ERROR(CheckUpdateFits(*cloth.model->source, cloth.parameters, update));
    Cloth changed = cloth;
    if (update.model) changed.model = made_->models.Get(update.model);
    if (update.parameters) changed.parameters = *update.parameters;
    if (update.state) {
      changed.state = ToFloat(*update.state, changed.model->particle_count);
      changed.fault = update.fault;
    }
    if (update.pin_targets_m) {
      changed.pin_targets = ToFloat(*update.pin_targets_m, *changed.model);
    } else if (update.model) {
      changed.pin_targets = TransferTargets(cloth, changed.state, *changed.model);
    }
    if (update.model) changed.own_lengths.reset();
    if (update.rest_lengths_m) {
      changed.own_lengths = ToOwnLengths(*update.rest_lengths_m, *changed.model);
    }
    if (update.collider_motions) changed.parameters.collider_motions = *update.collider_motions;
    // Energy is watched where no collider moves.
    if (update.model || update.parameters || update.rest_lengths_m || update.collider_motions) {
      SetScheme(changed);
      SetSurfaces(changed, *made_);
    }
    changed.may_cross_itself = update.may_cross_itself;
    cloth = std::move(changed);
    return Status::Ok();
  } catch (const std::bad_alloc&) {
    return OutOfMemory();
  }

 private:
  static double UsSince(std::chrono::steady_clock::time_point start) {
    const std::chrono::duration<double, std::micro> time = std::chrono::steady_clock::now() - start;
    return time.count();
  }

  // Working memory of one thread, apart from that of others.
  struct alignas(128) ThreadScratch {
    StepScratch single;
    std::deque<StepScratch> of_world;  // of all cloths but the first
    GroupScratch lanes;
    std::vector<std::vector<Vec4>> flights;  // ExpectedFlight::velocities of each lane
    StepTeam alone{1};
  };

  // Shared by the threads while they step a batch.
  struct SharedBatch {
    std::span<const StepItem> items;
    const Pause& pause;
    const std::vector<StepGroup> groups;
    const std::vector<std::unique_ptr<StepTeam>> teams;  // of each group; null: one thread's work
    std::vector<StepReport>& reports;                    // of each item
    std::atomic<size_t> next_group{0};
  };

  ThreadScratch& ScratchOfThisThread() {
    return scratch_.at(static_cast<size_t>(tbb::this_task_arena::current_thread_index()));
  }

  std::vector<Cloth*> ClothsOf(std::span<const StepItem> items) {
    std::vector<Cloth*> cloths;
    for (const StepItem& item : items) cloths.push_back(&cloths_.At(item.cloth));
    return cloths;
  }

  // Worlds of several cloths come first.
  std::vector<StepGroup> GroupsOf(std::span<const StepItem> items) {
    std::vector<StepGroup> groups;
    std::vector<GroupCandidate> batch;
    std::vector<uint32_t> places;  // of the candidates
    for (uint32_t k = 0; k < items.size(); ++k) {
      if (const auto count = static_cast<uint32_t>(WorldSize(items.subspan(k))); count > 1) {
        StepGroup& group = groups.emplace_back(count);
        std::iota(group.begin(), group.end(), k);
        k += count - 1;
        continue;
      }
      batch.push_back(CandidateOf(items[k]));
      places.push_back(k);
    }
    for (StepGroup& group : FormGroups(batch, lane_count_, static_cast<uint32_t>(thread_count_))) {
      for (uint32_t& place : group) place = places[place];
      groups.push_back(std::move(group));
    }
    return groups;
  }

  GroupCandidate CandidateOf(const StepItem& item) {
    const Cloth& cloth = cloths_.At(item.cloth);
    GroupCandidate candidate{cloth.model.get(), std::nullopt, !item.grips.empty(), item.impulses};
    if (lane_count_ == 1 || !ClothFitsLanes(cloth)) return candidate;
    if (cloth.contact_surface && !item.grips.empty()) return candidate;
    candidate.key.emplace(*cloth.model, cloth.scheme->controls,
                          IterationsOf(item, cloth.parameters.settings),
                          HasMovingColliders(cloth.parameters));
    return candidate;
  }

  static bool IsWorld(std::span<const StepItem> items, const StepGroup& group) {
    return group.size() > 1 && WorldSize(items.subspan(group[0])) == group.size();
  }

  // Null for groups that one thread steps.
  std::vector<std::unique_ptr<StepTeam>> TeamsOf(std::span<const StepItem> items,
                                                 const std::vector<StepGroup>& groups) {
    std::vector<std::unique_ptr<StepTeam>> teams(groups.size());
    for (size_t k = 0; k < groups.size() && thread_count_ > 1; ++k) {
      if (groups[k].size() > 1 && !IsWorld(items, groups[k])) continue;
      const auto together = items.subspan(groups[k][0], groups[k].size());
      if (LargestOf(ClothsOf(together)) < kMinTeamParticles) continue;
      teams[k] = std::make_unique<StepTeam>(static_cast<uint32_t>(thread_count_));
    }
    return teams;
  }

  void StepOnAllThreads(std::span<const StepItem> items, const Pause& pause,
                        std::vector<StepReport>& reports) {
    std::vector<StepGroup> groups = GroupsOf(items);
    std::vector<std::unique_ptr<StepTeam>> teams = TeamsOf(items, groups);
    const bool has_team =
        std::ranges::any_of(teams, [](const auto& team) { return team != nullptr; });
    const size_t all = static_cast<size_t>(thread_count_);
    const size_t threads = has_team ? all : std::min(all, groups.size());
    SharedBatch batch{items, pause, std::move(groups), std::move(teams), reports};
    arena_.execute([&] {
      tbb::parallel_for(
          tbb::blocked_range<size_t>(0, threads, 1),
          [&](const tbb::blocked_range<size_t>&) { WorkOn(batch); }, tbb::simple_partitioner());
    });
  }

  // One thread's part. Big cloths that others step are helped when no group is left, so a thread is
  // never kept from a cloth of its own; nothing waits for a thread that the arena does not have.
  void WorkOn(SharedBatch& batch) {
    const DenormalsAreZero denormals_are_zero;
    for (size_t k; (k = batch.next_group.fetch_add(1)) < batch.groups.size();) {
      StepOnThisThread(batch, k);
    }
    while (StepTeam* const team = SmallestOpenTeam(batch)) team->Join();
  }

  // Null: all cloths that have a team have been stepped.
  static StepTeam* SmallestOpenTeam(const SharedBatch& batch) {
    StepTeam* smallest = nullptr;
    for (const std::unique_ptr<StepTeam>& team : batch.teams) {
      if (!team || team->is_closed()) continue;
      if (!smallest || team->member_count() < smallest->member_count()) smallest = team.get();
    }
    return smallest;
  }

  // Touches only the cloths of the group and this thread's scratch memory.
  void StepOnThisThread(SharedBatch& batch, size_t index) {
    const StepGroup& group = batch.groups[index];
    const TeamLead lead{batch.teams[index].get()};
    if (batch.pause.IsDue()) {
      for (const uint32_t k : group) batch.reports[k].is_undone = true;
    } else if (group.size() > 1 && !IsWorld(batch.items, group)) {
      StepSideBySide(batch, group);
    } else {
      StepTogether(batch, group[0], group.size(),
                   lead.team != nullptr ? *lead.team : ScratchOfThisThread().alone);
    }
  }

  // Cloths of a group that may touch something, or leave their expected flight, are stepped alone.
  void StepSideBySide(SharedBatch& batch, const StepGroup& group) {
    const std::span<const StepItem> items = batch.items;
    StepGroup by_themselves;
    std::vector<GroupCloth> cloths;
    StepGroup in_lanes;  // of each of `cloths`
    for (const uint32_t k : group) {
      std::optional<GroupCloth> cloth = LaneOf(items[k], cloths.size());
      (cloth ? in_lanes : by_themselves).push_back(k);
      if (cloth) cloths.push_back(std::move(*cloth));
    }
    if (cloths.size() < MinGroupSize(lane_count_) && !by_themselves.empty()) {
      by_themselves.insert(by_themselves.end(), in_lanes.begin(), in_lanes.end());
      cloths.clear();
    }
    const auto start = std::chrono::steady_clock::now();
    if (!cloths.empty()) StepCloths(cloths, ScratchOfThisThread().lanes);
    const double us_per_lane = UsSince(start) / static_cast<double>(cloths.size());
    for (size_t lane = 0; lane < cloths.size(); ++lane) {
      const uint32_t k = in_lanes[lane];
      if (cloths[lane].must_be_alone) {
        by_themselves.push_back(k);
      } else {
        batch.reports[k] = EndLane(cloths_.At(items[k].cloth), cloths[lane]);
        batch.reports[k].thread_us = us_per_lane;
      }
    }
    for (const uint32_t k : by_themselves) StepTogether(batch, k, 1, ScratchOfThisThread().alone);
  }

  // The cloth of an item as the next lane has it; none: in this step it may touch itself, or its
  // edges a collider.
  std::optional<GroupCloth> LaneOf(const StepItem& item, size_t lane) {
    Cloth& cloth = cloths_.At(item.cloth);
    ThreadScratch& scratch = ScratchOfThisThread();
    SetTargets(cloth, item);
    GroupCloth next{ContextOf(cloth, item, *cloth.scheme, scratch.alone, scratch.single),
                    item.measure, cloth.state};
    if (MayTouchEdges(next.context, cloth.state)) return std::nullopt;
    if (cloth.contact_surface != nullptr && !FindFlight(next, lane)) return std::nullopt;
    return next;
  }

  StepReport EndLane(Cloth& cloth, GroupCloth& lane) {
    if (lane.has_gained_energy) {
      lane.report = StepCalmer(lane.context, lane.measure, lane.state);
      if (cloth.contact_surface != nullptr) {
        EndSelfContacts(cloth, lane.report, ScratchOfThisThread().single);
      }
    }
    EndStep(cloth, lane.report);
    return lane.report;
  }

  // Of a cloth that touches itself, for its lane. Whether nothing is expected to touch.
  bool FindFlight(GroupCloth& cloth, size_t lane) {
    const auto flight = ExpectNoContacts(cloth.context, cloth.state);
    if (!flight) return false;
    std::vector<std::vector<Vec4>>& flights = ScratchOfThisThread().flights;
    flights.resize(std::max(flights.size(), lane + 1));
    flights[lane].assign(flight->velocities.begin(), flight->velocities.end());
    cloth.flight = ExpectedFlight{flights[lane], flight->drift, flight->substep_s};
    return true;
  }

  // False: dropped.
  template <class Function>
  static bool DoOrDrop(const Function& function) {
    try {
      return function();
    } catch (const WorkStopped&) {
      return false;
    }
  }

  // One cloth, or all of a world: so many items from the first on.
  void StepTogether(SharedBatch& batch, size_t first, size_t count, StepTeam& team) {
    const auto start = std::chrono::steady_clock::now();
    const std::span<const StepItem> items = batch.items.subspan(first, count);
    const std::span<StepReport> reports = std::span(batch.reports).subspan(first, count);
    const std::vector<Cloth*> cloths = ClothsOf(items);
    ThreadScratch& scratch = ScratchOfThisThread();
    if (scratch.of_world.size() + 1 < cloths.size()) scratch.of_world.resize(cloths.size() - 1);
    std::vector<StepScratch*> scratches{&scratch.single};
    for (size_t k = 1; k < cloths.size(); ++k) scratches.push_back(&scratch.of_world[k - 1]);
    const bool is_faulted = cloths[0]->fault != FaultReason::kNone;
    if (!is_faulted) {
      for (size_t k = 0; k < cloths.size(); ++k) SetTargets(*cloths[k], items[k]);
    }
    DropWhenDue interruption(batch.pause);
    StepProgress progress;
    const bool is_done = DoOrDrop([&] {
      std::vector<SteppedCloth> stepped = SteppedOf(cloths, items, team, scratches, &interruption);
      if (!is_faulted) return ContinueStep(stepped, progress, batch.pause);
      MeasureFaulted(cloths, stepped, reports);
      return true;
    });
    for (size_t k = 0; k < cloths.size(); ++k) {
      if (is_done && is_faulted) continue;
      if (is_done) {
        reports[k] = progress.cloths[k].report;
        EndSelfContacts(*cloths[k], reports[k], *scratches[k]);
        EndStep(*cloths[k], reports[k]);
      } else {
        reports[k].is_undone = true;
        if (!is_faulted) DropTargets(*cloths[k]);
      }
      reports[k].thread_us = team.member_count() * UsSince(start) / static_cast<double>(count);
    }
  }

  // Valid as long as the cloths are not changed.
  std::vector<SteppedCloth> SteppedOf(std::span<Cloth* const> cloths,
                                      const std::span<const StepItem>& items, StepTeam& team,
                                      std::span<StepScratch* const> scratches,
                                      Interruption* interruption) {
    std::vector<SteppedCloth> stepped;
    const std::shared_ptr<const World> world =
        cloths.size() > 1 ? WorldOf(cloths, made_->surfaces, interruption) : nullptr;
    for (size_t k = 0; k < cloths.size(); ++k) {
      const Scheme& scheme = world ? *world->schemes[k] : *cloths[k]->scheme;
      stepped.push_back({ContextOf(*cloths[k], items[k], scheme, team, *scratches[k]),
                         items[k].measure, cloths[k]->state});
      stepped.back().context.interruption = interruption;
    }
    if (world) EnterWorld(*world, items, stepped);
    return stepped;
  }

  StepContext ContextOf(Cloth& cloth, const StepItem& item, const Scheme& scheme, StepTeam& team,
                        StepScratch& scratch) const {
    return cpu::ContextOf(cloth, item, scheme, leaves_out_colliders_, team, scratch);
  }

  const int thread_count_;
  tbb::task_arena arena_;
  const uint32_t lane_count_;  // 1: every cloth is stepped alone
  const std::string arithmetic_ = ArithmeticOf(lane_count_);
  const bool leaves_out_colliders_;
  std::vector<ThreadScratch> scratch_;  // one per thread of the arena
  const std::shared_ptr<PartsOfModels> made_ = std::make_shared<PartsOfModels>();
  ClothSlots<Cloth> cloths_;
};

}  // namespace
}  // namespace cpu

std::unique_ptr<Backend> CreateCpuBackend(const CpuBackendOptions& options,
                                          const CpuBackendTesting& testing) {
  return std::make_unique<cpu::CpuBackend>(options, testing);
}

}  // namespace drape
