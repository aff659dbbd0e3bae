// Long device work in small pieces.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "server/scheduler/scheduler.h"

namespace drape {

// Largest number of particles that one command creates or resets (but at least one cloth): a few
// milliseconds, so that other sessions step between the commands of a large creation.
inline constexpr uint64_t kSliceParticles = uint64_t{1} << 18;
// And of cloths, however small.
inline constexpr size_t kSliceCloths = 1024;

// Cloths that each cost as much as so many particles (SliceCost) per slice; >= 1.
size_t ClothsPerSlice(uint64_t cost);

// Runs `slice(backend, begin, end)` for consecutive ranges that cover [0, count), each in a command
// of its own of this owner (Scheduler::Post), until one fails; then `finish` with the outcome,
// once, on the device thread. If the first command is not accepted (Scheduler::Post), returns that
// error and calls neither.
Status RunInSlices(Scheduler& scheduler, const std::string& owner, size_t count, size_t per_slice,
                   std::function<Status(Backend&, size_t begin, size_t end)> slice,
                   std::function<void(Backend&, const Status&)> finish);

// The same, but no other command of the owner comes between two slices: what they find out, or
// change, of the cloths of a session stays so. Steps come between, except of cloths that are held
// (ClothRuntime::Hold).
Status RunAsOne(Scheduler& scheduler, const std::string& owner, size_t count, size_t per_slice,
                std::function<Status(Backend&, size_t begin, size_t end)> slice,
                std::function<void(Backend&, const Status&)> finish);

// RunAsOne for what frees something: ignores the limits (Scheduler::PostCleanup). False after
// Drain: it calls nothing.
[[nodiscard]] bool CleanUpAsOne(Scheduler& scheduler, const std::string& owner, size_t count,
                                size_t per_slice,
                                std::function<Status(Backend&, size_t begin, size_t end)> slice,
                                std::function<void(Backend&, const Status&)> finish);

// In a command of the owner, or in `finish` of RunAsOne: goes on with more of it. The whole is done
// before this returns where it is one slice, or none.
void ContinueAsOne(Backend& backend, Scheduler& scheduler, const std::string& owner, size_t count,
                   size_t per_slice,
                   std::function<Status(Backend&, size_t begin, size_t end)> slice,
                   std::function<void(Backend&, const Status&)> finish);

}  // namespace drape
