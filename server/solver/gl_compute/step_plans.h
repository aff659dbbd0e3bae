// How a group of cloths of one variant is dispatched. Every call with the context current and the
// arrays bound (DeviceArrays::BindForStep).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/solver/gl_compute/device_arrays.h"
#include "server/solver/gl_compute/gl_cloth.h"
#include "server/solver/pause.h"

namespace drape {

// Cloths of one array of scratch memory: items [first_item, first_item + cloths.size()) of the
// block Items.
struct ItemGroup {
  uint32_t first_item = 0;
  std::vector<const GlCloth*> cloths{};
  const gl::Buffer* scratch = nullptr;

  uint32_t size() const { return static_cast<uint32_t>(cloths.size()); }
  // Before its dispatches.
  void BindScratch() const;
};

// Those of one variant.
struct VariantGroup : ItemGroup {
  const StepKernels* kernels = nullptr;

  bool is_tiled() const { return kernels->variant.is_tiled(); }
};

// Largest dispatch of the device [work groups].
struct DispatchLimits {
  uint32_t group_count_x = 0;
  uint32_t group_count_y = 0;
};

// The next work group's reads see all writes before.
void DeviceBarrier();

// One work group per item of a kernel that indexes Items by gl_WorkGroupID.x, and a DeviceBarrier.
// Returns the dispatches.
uint32_t DispatchPerItem(const gl::Program& kernel, uint32_t first_item, uint32_t item_count,
                         const DispatchLimits& limits);

// The kernels that measure cloths of all variants, and those that add up their impulses.
struct MeasureKernels {
  const gl::Program* start = nullptr;
  const gl::Program* pieces = nullptr;
  const gl::Program* total = nullptr;
  const gl::Program* strains = nullptr;
  const gl::Program* impulses_begin = nullptr;
  const gl::Program* impulses_total = nullptr;

  std::vector<const gl::Program*> All() const {
    return {start, pieces, total, strains, impulses_begin, impulses_total};
  }
};

// The whole step of the groups of the resident plan; others are left out. The groups run at the
// same time, since none touches what another one does. Returns the number of dispatches, which
// depends on the variants and the settings but not on the number of cloths (up to the limits of one
// dispatch and of one array).
uint32_t StepResident(std::span<const VariantGroup> groups, const DispatchLimits& limits);
// The parts [part, part_count) of the step of one cloth, until `pause` is due; `part` counts up.
// Returns whether all are done. Adds to `dispatch_count`.
bool ContinueResident(const VariantGroup& cloth, const DispatchLimits& limits, uint64_t& part,
                      const Pause& pause, uint32_t& dispatch_count);
// Before the step: keeps the positions of the items, from which Measure finds how far they move.
// Returns the dispatches: one.
uint32_t KeepStart(const MeasureKernels& kernels, const ItemGroup& group,
                   const DispatchLimits& limits);
// After the step: measures the items. Returns the dispatches: two, or three if any cloth has more
// than one piece.
uint32_t Measure(const MeasureKernels& kernels, const ItemGroup& group,
                 const DispatchLimits& limits);
// Before and after the step of items that tell impulses: clears their sums; adds them up. Each
// returns the dispatches: one.
uint32_t BeginImpulses(const MeasureKernels& kernels, const ItemGroup& group,
                       const DispatchLimits& limits);
uint32_t TotalImpulses(const MeasureKernels& kernels, const ItemGroup& group,
                       const DispatchLimits& limits);

}  // namespace drape
