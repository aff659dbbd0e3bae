// UpdateCloths behind its handler: check, find, build other models where needed, change.
#pragma once

#include <functional>

#include "drape/v1/cloths.pb.h"
#include "server/api/simulation_service.h"

namespace drape::api {

// `hold`: at most once, before `done`. `done` exactly once, on any thread, possibly before this returns. `request` is not used
// afterwards.
void StartUpdate(const ServiceContext& context, const Caller& caller,
                   const v1::UpdateClothsRequest& request, const CancelToken& cancel, const Hold& hold,
                 std::function<void(Result<v1::UpdateClothsResponse>)> done);

}  // namespace drape::api
