// Two backends as one: what the first cannot step, the second steps.
#pragma once

#include <memory>

#include "server/solver/backend.h"

namespace drape {

// Cloths that `first` can step (BackendDescription::can_step) are its own, the others those of
// `second`, which can step all; a Write after which a cloth belongs to the other one moves it
// there. So does a step in which what is held pulls a cloth whose edges something may catch
// (ColliderContact::kAuto); the next one in which nothing pulls moves it back. The pair has the
// name, the device and the copies on it of `first`, and steps cloths of both at the same time where
// that device runs ahead. Both compute in the same precision.
std::unique_ptr<Backend> PairBackends(std::unique_ptr<Backend> first,
                                      std::unique_ptr<Backend> second);

}  // namespace drape
