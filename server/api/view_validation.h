// From a StateView to what is wanted of the states, or INVALID_ARGUMENT. Pure.
#pragma once

#include "drape/v1/state.pb.h"
#include "server/api/field_checks.h"
#include "server/core/status.h"
#include "server/scheduler/step_work.h"
#include "server/session/session.h"

namespace drape::api {

// Of a list: requests that wait keep it. Who wants more takes all.
inline constexpr int kMaxViewParticles = 4096;

// `path`: of the view. No field asked for: positions. Particles that are not strictly ascending, or
// more than kMaxViewParticles, are violations.
StateFields CheckView(const FieldPath& path, const v1::StateView& view, Violations& violations);

// INVALID_ARGUMENT that names the particles which one of the cloths does not have. `fields` come
// from CheckView.
Status CheckClothsHaveParticles(const FieldPath& path, const StateFields& fields,
                                const ClothList& cloths);

}  // namespace drape::api
