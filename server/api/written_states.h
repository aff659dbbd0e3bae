// The states of a WriteStatesRequest, cloth by cloth in their own frames. Pure.
#pragma once

#include <vector>

#include "drape/v1/simulation_service.pb.h"
#include "server/core/status.h"
#include "server/scene/particle_state.h"
#include "server/session/session.h"

namespace drape::api {

// INVALID_ARGUMENT that names arrays whose form is wrong, whatever the cloths are.
Status CheckWriteStates(const v1::WriteStatesRequest& request);

// The request has passed CheckWriteStates. INVALID_ARGUMENT if the rows are not those of the
// cloths, or a number is not finite or beyond the limits of states.
Result<std::vector<ParticleState>> ToStates(const v1::WriteStatesRequest& request,
                                            const ClothList& cloths);

}  // namespace drape::api
