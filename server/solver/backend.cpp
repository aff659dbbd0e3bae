#include "server/solver/backend.h"

#include <utility>

namespace drape {
namespace {

class FinishedRead final : public PendingRead {
 public:
  explicit FinishedRead(StateColumns columns) : columns_(std::move(columns)) {}
  StateColumns Take() override { return std::move(columns_); }

 private:
  StateColumns columns_;
};

}  // namespace

std::unique_ptr<PendingRead> Backend::BeginRead(const ReadRequest& request) {
  return std::make_unique<FinishedRead>(Read(request));
}

}  // namespace drape
