// Reads states of cloths from the backend.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "server/scheduler/step_work.h"
#include "server/solver/device_backend.h"

namespace drape {

// The cloths of one receiver; all alive.
using ClothSpan = std::span<const std::shared_ptr<ClothRuntime>>;

// What a row of the columns is: a particle as clients count them, or one of the model. They differ
// where the repair of a mesh made several vertices one particle.
enum class RowsAre { kDescribed, kParticles };

// One BeginRead for all receivers, and the rows that each of them will get. Device thread.
class SharedRead {
 public:
  SharedRead(Backend& backend, std::span<const ClothSpan> receivers, const StateFields& fields,
             RowsAre rows_are = RowsAre::kDescribed);
  // A slice of the columns for each receiver. Once.
  std::vector<StateColumns> Take();

 private:
  // The rows of one cloth, by its model's particles.
  struct ClothRows {
    std::shared_ptr<const SceneModel> model;
    size_t receiver = 0;
  };

  std::vector<StateColumns> Described(const StateColumns& all) const;

  std::unique_ptr<PendingRead> read_;
  std::vector<size_t> rows_;         // of each receiver
  std::vector<ClothRows> cloths_;    // empty: the rows of the backend are those that were asked for
  std::vector<uint32_t> particles_;  // with `cloths_`: of the view
};

// Stamps and columns of the cloths, all alive. Device thread.
ClothStates ReadClothStates(Backend& backend, ClothSpan cloths, const StateFields& fields);

// For pictures: like ReadClothStates, but by the particles of the model, and whole cloths only
// (`fields` names no particles). With `on_device` a copy on the device instead of the columns, if
// the backend can make one.
ClothStates ReadForPicture(Backend& backend, ClothSpan cloths, const StateFields& fields,
                           bool on_device);

}  // namespace drape
