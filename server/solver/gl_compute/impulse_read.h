// Brings the impulses of steps to the host.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "server/solver/gl_compute/device_arrays.h"
#include "server/solver/gl_compute/gl_cloth.h"
#include "server/solver/gl_compute/state_reader.h"
#include "server/solver/step_impulses.h"

namespace drape {

// Of cloths whose last step was asked for them, by the schemes that they still have; in their
// order. With the context current; waits for the device.
std::vector<std::shared_ptr<const StepImpulses>> ReadImpulses(
    std::span<const GlCloth* const> cloths, const DeviceArrays& arrays, StateReader& reader);

}  // namespace drape
