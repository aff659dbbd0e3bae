// The readable specification of the step as a backend: "reference", float64, one core.
#pragma once

#include <memory>

#include "server/solver/backend.h"

namespace drape {

std::unique_ptr<Backend> CreateReferenceBackend();

}  // namespace drape
