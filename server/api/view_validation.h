// From a StateView to the wanted fields of the states, or INVALID_ARGUMENT. Pure.
#pragma once

#include "drape/v1/state.pb.h"
#include "server/api/field_checks.h"
#include "server/core/status.h"
#include "server/scheduler/step_work.h"
#include "server/session/session.h"

namespace drape::api {

// Longest list of particles, because waiting requests keep it in memory. A client that wants more
// reads all particles.
inline constexpr int kMaxViewParticles = 4096;

// `path` leads to the view. Without a field, positions are meant. Particles that are not strictly
// ascending, or more than kMaxViewParticles, are violations.
StateFields CheckView(const FieldPath& path, const v1::StateView& view, Violations& violations);

// INVALID_ARGUMENT that names the particles which one of the cloths does not have. `fields` come
// from CheckView.
Status CheckClothsHaveParticles(const FieldPath& path, const StateFields& fields,
                                const ClothList& cloths);

}  // namespace drape::api
