#include "server/api/shared_chunks.h"

#include <new>
#include <utility>

#include "server/core/check.h"

namespace drape::api {

SharedChunks::SharedChunks(StateChunker chunker, std::function<void()> on_encoding)
    : source_(std::make_shared<Source>()), at_(std::make_shared<Link>()) {
  source_->chunker = std::move(chunker);
  source_->on_encoding = std::move(on_encoding);
}

MessageSlices SharedChunks::Next() {
  DRAPE_CHECK(has_next(), "no chunk left");
  const std::lock_guard lock(source_->mutex);
  if (at_->next == nullptr) at_->next = Encode(*source_);
  at_ = at_->next;
  return at_->chunk;
}

std::shared_ptr<SharedChunks::Link> SharedChunks::Encode(Source& source) {
  if (const auto on_encoding = std::exchange(source.on_encoding, nullptr)) on_encoding();
  // Where there was no memory for a chunk, the next one would not be its successor.
  if (std::exchange(source.is_broken, true)) throw std::bad_alloc();
  auto link = std::make_shared<Link>();
  link->chunk = source.chunker->Next();
  source.is_broken = false;
  link->is_last = !source.chunker->has_next();
  if (link->is_last) source.chunker.reset();
  return link;
}

}  // namespace drape::api
