// CreateCloths behind its handler: check, build the model off the gRPC thread, create, remember.
#pragma once

#include <functional>

#include "drape/v1/cloths.pb.h"
#include "server/api/simulation_service.h"

namespace drape::api {

// Calls `done` exactly once, on any thread; `request` must stay valid until then. A cancelled
// creation ends at once, also while its model is built (PostBuild).
void StartCreation(const ServiceContext& context, const Caller& caller,
                   const v1::CreateClothsRequest& request, const CancelToken& cancel,
                   const Hold& hold, std::function<void(Result<v1::CreateClothsResponse>)> done);

}  // namespace drape::api
