// What rest lengths of cloths' own count for.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "server/core/status.h"
#include "server/scheduler/step_controls.h"
#include "server/session/cloth_record.h"
#include "server/session/model_cache.h"
#include "server/session/saved_states.h"

namespace drape {

// A cloth, and the model by which its lengths are going to be driven.
struct DrivenCloth {
  std::shared_ptr<ClothRecord> cloth;
  std::shared_ptr<const SceneModel> model;
};

// The cloths that the controls drive; a cloth may occur several times. `becoming` as in
// ResolveControls.
std::vector<DrivenCloth> DrivenBy(
    const StepControls& controls, std::span<const std::shared_ptr<ClothRecord>> cloths,
    std::span<const std::shared_ptr<const ClothDescription>> becoming);
// Those that go on from a cloth whose lengths were driven.
std::vector<DrivenCloth> DrivenBy(std::span<const LoadPair> pairs);

// Every constraint of these cloths counts among the models of `owner` until its cloth ends: what
// was driven once is mostly driven again. RESOURCE_EXHAUSTED (QUOTA_EXCEEDED): none counts more
// than before. Any thread.
Status ChargeLengths(std::span<const DrivenCloth> driven, ModelCache& models,
                     const std::string& owner);

}  // namespace drape
