#include "server/solver/gl_compute/step_batch.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cstring>
#include <map>
#include <vector>

#include "server/gl/sync.h"
#include "server/solver/gl_compute/tiled_step.h"
#include "shaders/interface/bindings.h"

namespace drape {

namespace {

int64_t NowUs() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

// The contents of the block Items, and how they are dispatched.
struct BatchPlan {
  std::vector<shader::BatchItem> items;
  std::vector<VariantGroup> groups;
  std::vector<ItemGroup> measured;
  std::vector<ItemGroup> telling;  // impulses
};

// The items of these cloths of the batch; they have scratch memory in one array.
ItemGroup AddGroup(std::span<const StepItem> items, std::span<const uint32_t> indices,
                   GlClothTable& cloths, const ScratchPool& scratch, BatchPlan& plan) {
  ItemGroup group{.first_item = static_cast<uint32_t>(plan.items.size())};
  for (const uint32_t index : indices) {
    group.cloths.push_back(&cloths.Find(items[index].cloth));
    plan.items.push_back({items[index].cloth.slot, index});
  }
  group.scratch = &scratch.buffer(group.cloths.front()->scratch.array());
  return group;
}

// Cloths of one variant together, in the order of the batch. Faulted cloths are measured but not
// stepped.
BatchPlan PlanBatch(std::span<const StepItem> items, GlClothTable& cloths,
                    const ScratchPool& scratch) {
  std::map<std::pair<KernelVariant, uint32_t>, std::vector<uint32_t>> by_variant;
  std::map<uint32_t, std::vector<uint32_t>> measured;
  std::map<uint32_t, std::vector<uint32_t>> telling;
  for (uint32_t index = 0; index < items.size(); ++index) {
    const GlCloth& cloth = cloths.Find(items[index].cloth);
    const uint32_t array = cloth.scratch.array();
    if (items[index].measure) measured[array].push_back(index);
    if (cloth.fault != FaultReason::kNone) continue;
    if (cloth.tells_impulses) telling[array].push_back(index);
    by_variant[{cloth.step_kernels()->variant, array}].push_back(index);
  }
  BatchPlan plan;
  for (const auto& [variant, indices] : by_variant) {
    VariantGroup group{AddGroup(items, indices, cloths, scratch, plan)};
    group.kernels = group.cloths.front()->step_kernels();
    plan.groups.push_back(std::move(group));
  }
  for (const auto& [array, indices] : measured) {
    plan.measured.push_back(AddGroup(items, indices, cloths, scratch, plan));
  }
  for (const auto& [array, indices] : telling) {
    plan.telling.push_back(AddGroup(items, indices, cloths, scratch, plan));
  }
  return plan;
}

// Before the step of the items; the dispatches.
uint32_t BeginReports(const BatchPlan& plan, const MeasureKernels& measure,
                      const DispatchLimits& limits) {
  uint32_t dispatch_count = 0;
  for (const ItemGroup& group : plan.measured) dispatch_count += KeepStart(measure, group, limits);
  for (const ItemGroup& group : plan.telling) {
    dispatch_count += BeginImpulses(measure, group, limits);
  }
  return dispatch_count;
}

// After it.
uint32_t EndReports(const BatchPlan& plan, const MeasureKernels& measure,
                    const DispatchLimits& limits) {
  uint32_t dispatch_count = 0;
  for (const ItemGroup& group : plan.measured) dispatch_count += Measure(measure, group, limits);
  for (const ItemGroup& group : plan.telling) {
    dispatch_count += TotalImpulses(measure, group, limits);
  }
  return dispatch_count;
}

uint32_t Dispatch(const BatchPlan& plan, DeviceArrays& arrays, const MeasureKernels& measure,
                  const DispatchLimits& limits) {
  arrays.BindForStep();
  uint32_t dispatch_count = BeginReports(plan, measure, limits);
  for (const VariantGroup& group : plan.groups) {
    if (group.is_tiled()) dispatch_count += StepTiled(group, limits, arrays.dispatches);
  }
  dispatch_count += StepResident(plan.groups, limits);
  return dispatch_count + EndReports(plan, measure, limits);
}

FaultReason FaultOf(const shader::ClothStatus& status) {
  if ((status.fault & DRAPE_FAULT_NOT_FINITE) != 0) return FaultReason::kNotFinite;
  if ((status.fault & DRAPE_FAULT_RUNAWAY) != 0) return FaultReason::kRunaway;
  return FaultReason::kNone;
}

Measurements ToMeasurements(const shader::ClothStatus& status) {
  return {.max_strain = status.max_strain,
          .rms_strain = status.rms_strain,
          .strain_p50 = status.strain_p50,
          .strain_p90 = status.strain_p90,
          .strain_p99 = status.strain_p99,
          .rms_motion_m = status.rms_motion,
          .kinetic_energy_j = status.kinetic_energy,
          .potential_energy_j = status.potential_energy,
          .strain_energy_j = status.strain_energy,
          .lowest_m = status.lowest,
          .contacts = status.contacts,
          .max_penetration_m = status.max_penetration,
          .max_residual_m = status.max_residual};
}

StepReport ToReport(const StepItem& item, const shader::ClothStatus& status, GlCloth& cloth) {
  StepReport report;
  const bool was_stepped = cloth.fault == FaultReason::kNone;
  const bool has_gained =
      was_stepped && cloth.kernels->variant.Has(Feature::kEnergyWatch) && status.gained_energy != 0;
  const bool starts_crossing = cloth.touches_itself() && !cloth.crossing_flags.empty();
  cloth.pairs_wanted = 0;
  if (was_stepped && cloth.touches_itself()) {
    const bool has_room = status.contact_pairs <= cloth.contacts.capacity;
    if (!has_room && cloth.may_take_more_pairs) {
      cloth.pairs_wanted = status.contact_pairs;
      cloth.must_step_again = false;
      return report;
    }
    cloth.may_cross_itself = starts_crossing || status.contacts_failed != 0;
  }
  cloth.must_step_again = has_gained && cloth.gain_response == GainResponse::kStepAgain;
  if (cloth.must_step_again) return report;
  if (was_stepped) {
    cloth.fault = FaultOf(status);
    report.iterations = status.iterations;
    report.converged = cloth.plan.tolerance == 0 || status.unconverged_substeps == 0;
    report.warnings = cloth.plan.known_warnings;
    report.warnings.starts_crossing = starts_crossing;
    report.warnings.contacts_given_up = cloth.touches_itself() && status.contacts_given_up != 0;
    report.warnings.not_converged = !report.converged;
    report.warnings.energy_gained = has_gained || cloth.gain_response == GainResponse::kNotWatched;
  }
  report.fault = cloth.fault;
  if (item.measure) {
    report.measured = ToMeasurements(status);
    report.warnings.strain_beyond_limit =
        was_stepped && report.measured.max_strain > cloth.plan.strain_limit;
    // The residual belongs to a solve whose result was discarded.
    if (cloth.fault != FaultReason::kNone) report.measured.max_residual_m = 0;
  }
  return report;
}

uint32_t CountLeftOut(const BatchPlan& plan, std::span<const shader::ClothStatus> statuses) {
  uint32_t count = 0;
  for (const VariantGroup& group : plan.groups) {
    if (!group.kernels->variant.Has(Feature::kColliderReach)) continue;
    for (size_t k = 0; k < group.cloths.size(); ++k) {
      const shader::BatchItem& item = plan.items[group.first_item + k];
      count += static_cast<uint32_t>(std::popcount(statuses[item.status].far_colliders));
    }
  }
  return count;
}

}  // namespace

BatchReport RunBatch(std::span<const StepItem> items, GlClothTable& cloths, DeviceArrays& arrays,
                     const MeasureKernels& measure, const BatchDevice& device,
                     const std::function<void()>& meanwhile) {
  BatchReport batch;
  if (items.empty()) return batch;
  const int64_t start_us = NowUs();
  const BatchPlan plan = PlanBatch(items, cloths, arrays.scratch);
  arrays.items.Upload(0, std::as_bytes(std::span(plan.items)));
  arrays.cloths.Flush();
  arrays.parameters.Flush();
  batch.upload_us = NowUs() - start_us;

  gl::TimerQuery timer;
  timer.Start();
  batch.dispatch_count = Dispatch(plan, arrays, measure, device.limits);
  timer.Stop();
  const size_t status_bytes = items.size() * sizeof(shader::ClothStatus);
  arrays.read_statuses.CopyFrom(arrays.statuses, 0, 0, status_bytes);
  const gl::Fence stepped = gl::Fence::Insert();
  if (meanwhile) meanwhile();
  stepped.Wait();
  const int64_t readback_start_us = NowUs();
  batch.device_us =
      device.has_timer_queries ? timer.ElapsedUs() : readback_start_us - start_us - batch.upload_us;
  std::vector<shader::ClothStatus> statuses(items.size());
  std::memcpy(statuses.data(), arrays.read_statuses.bytes(), status_bytes);
  batch.readback_us = NowUs() - readback_start_us;
  if (device.on_left_out) device.on_left_out(CountLeftOut(plan, statuses));
  for (size_t index = 0; index < items.size(); ++index) {
    batch.reports.push_back(
        ToReport(items[index], statuses[index], cloths.Find(items[index].cloth)));
  }
  return batch;
}

std::optional<BatchReport> RunPiece(const StepItem& item, GlClothTable& cloths,
                                    DeviceArrays& arrays, const MeasureKernels& measure,
                                    const BatchDevice& device, LongStep& step, const Pause& pause) {
  BatchReport batch;
  const int64_t start_us = NowUs();
  const BatchPlan plan = PlanBatch({&item, 1}, cloths, arrays.scratch);
  arrays.items.Upload(0, std::as_bytes(std::span(plan.items)));
  arrays.cloths.Flush();
  arrays.parameters.Flush();
  arrays.BindForStep();
  if (step.status.has_value()) {
    arrays.statuses.Upload(0, std::as_bytes(std::span(&*step.status, 1)));
  } else {
    batch.dispatch_count += BeginReports(plan, measure, device.limits);
  }
  const VariantGroup& group = plan.groups[0];
  const bool is_complete =
      group.kernels->variant.is_tiled()
          ? ContinueTiled(group, arrays.dispatches, step.tiled, pause, batch.dispatch_count)
          : ContinueResident(group, device.limits, step.part, pause, batch.dispatch_count);
  if (is_complete) batch.dispatch_count += EndReports(plan, measure, device.limits);
  shader::ClothStatus& status = step.status.emplace();
  arrays.statuses.Download(0, std::as_writable_bytes(std::span(&status, 1)));
  batch.device_us = NowUs() - start_us;
  if (!is_complete) return std::nullopt;
  if (device.on_left_out) device.on_left_out(CountLeftOut(plan, {&status, 1}));
  batch.reports.push_back(ToReport(item, status, cloths.Find(item.cloth)));
  return batch;
}

}  // namespace drape
