// The parts of a scene that the client itself uses.
#pragma once

#include "drape/v1/scene.pb.h"

namespace drape {
inline namespace client {

// Checks time step, duration, counts, spacings and controls; the server checks the specs.
// `scene.time_step_s` is set. Throws BadField.
void CheckScene(const v1::Scene& scene);

}  // namespace client
}  // namespace drape
