#include "server/solver/gl_compute/step_plans.h"

#include <algorithm>

#include "shaders/interface/bindings.h"

namespace drape {

void DeviceBarrier() {
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT |
                  GL_BUFFER_UPDATE_BARRIER_BIT);
}

void ItemGroup::BindScratch() const {
  scratch->BindStorage(DRAPE_BINDING_SCRATCH);
}

namespace {

uint32_t DispatchWithoutBarrier(const gl::Program& kernel, uint32_t first_item, uint32_t item_count,
                                const DispatchLimits& limits) {
  kernel.Use();
  uint32_t dispatch_count = 0;
  for (uint32_t done = 0; done < item_count; ++dispatch_count) {
    const uint32_t count = std::min(item_count - done, limits.group_count_x);
    kernel.SetUniform(DRAPE_UNIFORM_FIRST_ITEM, first_item + done);
    glDispatchCompute(count, 1, 1);
    done += count;
  }
  return dispatch_count;
}

// Of a group of the resident plan; 0 for others.
uint64_t PartCount(const VariantGroup& group) {
  if (group.is_tiled()) return 0;
  uint64_t count = 1;
  for (const GlCloth* cloth : group.cloths) count = std::max(count, cloth->part_count);
  return count;
}

// Without a barrier behind it.
uint32_t DispatchPart(const VariantGroup& group, uint64_t part, const DispatchLimits& limits) {
  const gl::Program& kernel = *group.kernels->resident_step;
  kernel.SetUniform(DRAPE_UNIFORM_PART, part == 0 ? 0 : 1);
  group.BindScratch();
  return DispatchWithoutBarrier(kernel, group.first_item, group.size(), limits);
}

}  // namespace

uint32_t DispatchPerItem(const gl::Program& kernel, uint32_t first_item, uint32_t item_count,
                         const DispatchLimits& limits) {
  const uint32_t dispatch_count = DispatchWithoutBarrier(kernel, first_item, item_count, limits);
  DeviceBarrier();
  return dispatch_count;
}

uint32_t StepResident(std::span<const VariantGroup> groups, const DispatchLimits& limits) {
  uint64_t most_parts = 0;
  for (const VariantGroup& group : groups) most_parts = std::max(most_parts, PartCount(group));
  uint32_t dispatch_count = 0;
  for (uint64_t part = 0; part < most_parts; ++part) {
    for (const VariantGroup& group : groups) {
      if (part < PartCount(group)) dispatch_count += DispatchPart(group, part, limits);
    }
    DeviceBarrier();
  }
  return dispatch_count;
}

bool ContinueResident(const VariantGroup& group, const DispatchLimits& limits, uint64_t& part,
                      const Pause& pause, uint32_t& dispatch_count) {
  const uint64_t part_count = PartCount(group);
  while (part < part_count) {
    dispatch_count += DispatchPart(group, part, limits);
    DeviceBarrier();
    if (++part == part_count || pause.is_never()) continue;
    glFinish();
    if (pause.IsDue()) return false;
  }
  return true;
}

namespace {

uint32_t LargestPieceCount(std::span<const GlCloth* const> cloths) {
  uint32_t largest = 1;
  for (const GlCloth* cloth : cloths) {
    largest = std::max(largest, MeasurePieceCount(*cloth->model->model));
  }
  return largest;
}

// A work group for each piece of each item.
uint32_t DispatchPerPiece(const gl::Program& kernel, uint32_t first_item, uint32_t item_count,
                          uint32_t largest_piece_count, const DispatchLimits& limits) {
  kernel.Use();
  uint32_t dispatch_count = 0;
  for (uint32_t done = 0; done < item_count; ++dispatch_count) {
    const uint32_t count = std::min(item_count - done, limits.group_count_y);
    kernel.SetUniform(DRAPE_UNIFORM_FIRST_ITEM, first_item + done);
    glDispatchCompute(largest_piece_count, count, 1);
    done += count;
  }
  DeviceBarrier();
  return dispatch_count;
}

}  // namespace

uint32_t KeepStart(const MeasureKernels& kernels, const ItemGroup& group,
                   const DispatchLimits& limits) {
  group.BindScratch();
  return DispatchPerPiece(*kernels.start, group.first_item, group.size(),
                          LargestPieceCount(group.cloths), limits);
}

uint32_t Measure(const MeasureKernels& kernels, const ItemGroup& group,
                 const DispatchLimits& limits) {
  group.BindScratch();
  const uint32_t largest_piece_count = LargestPieceCount(group.cloths);
  uint32_t dispatch_count = DispatchPerPiece(*kernels.pieces, group.first_item, group.size(),
                                             largest_piece_count, limits);
  if (largest_piece_count > 1) {
    dispatch_count += DispatchPerItem(*kernels.total, group.first_item, group.size(), limits);
  }
  return dispatch_count + DispatchPerItem(*kernels.strains, group.first_item, group.size(), limits);
}

uint32_t BeginImpulses(const MeasureKernels& kernels, const ItemGroup& group,
                       const DispatchLimits& limits) {
  group.BindScratch();
  uint32_t most_groups = 1;
  for (const GlCloth* cloth : group.cloths) {
    most_groups = std::max(most_groups, CountClearingGroups(*cloth));
  }
  return DispatchPerPiece(*kernels.impulses_begin, group.first_item, group.size(), most_groups,
                          limits);
}

uint32_t TotalImpulses(const MeasureKernels& kernels, const ItemGroup& group,
                       const DispatchLimits& limits) {
  group.BindScratch();
  return DispatchPerPiece(*kernels.impulses_total, group.first_item, group.size(),
                          LargestPieceCount(group.cloths), limits);
}

}  // namespace drape
