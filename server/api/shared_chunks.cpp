#include "server/api/shared_chunks.h"

#include <utility>

#include "server/core/check.h"

namespace drape::api {

SharedChunks::SharedChunks(StateChunker chunker, std::function<void()> on_encoding)
    : source_(std::make_shared<Source>()), at_(std::make_shared<Link>()) {
  source_->chunker = std::move(chunker);
  source_->on_encoding = std::move(on_encoding);
}

grpc::Slice SharedChunks::Next() {
  DRAPE_CHECK(has_next(), "no chunk left");
  const std::lock_guard lock(source_->mutex);
  if (at_->next == nullptr) at_->next = Encode(*source_);
  at_ = at_->next;
  return at_->bytes;
}

std::shared_ptr<SharedChunks::Link> SharedChunks::Encode(Source& source) {
  if (const auto on_encoding = std::exchange(source.on_encoding, nullptr)) on_encoding();
  v1::StateChunk chunk;
  source.chunker->Next(&chunk);
  auto link = std::make_shared<Link>();
  link->is_last = !source.chunker->has_next();
  if (link->is_last) source.chunker.reset();
  link->bytes = grpc::Slice(chunk.ByteSizeLong());
  // gRPC has no other way to fill a slice; nobody else has it yet.
  chunk.SerializeWithCachedSizesToArray(const_cast<uint8_t*>(link->bytes.begin()));
  return link;
}

}  // namespace drape::api
