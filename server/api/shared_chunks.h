// The chunks of a frame, encoded once for all streams that send it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "server/api/state_chunks.h"

namespace drape::api {

// A place among the chunks of a frame, as serialised StateChunks without the fields of a
// subscription (`frame`, `frames_dropped`). A copy begins where the original is. Each chunk is made
// when the first of the copies gets to it and is kept until the last one has passed it or is gone.
// Copies may be used on different threads, each by one at a time.
class SharedChunks {
 public:
  // `on_encoding` is called once, when the first chunk is made; may be null.
  explicit SharedChunks(StateChunker chunker, std::function<void()> on_encoding = nullptr);

  // False after the last chunk.
  bool has_next() const { return !at_->is_last; }
  // Throws std::bad_alloc, as do all copies from then on, where there is no memory for a chunk.
  MessageSlices Next();

 private:
  // A chunk keeps those behind it, so nobody has to count who still needs which.
  struct Link {
    MessageSlices chunk;
    bool is_last = false;
    std::shared_ptr<Link> next;  // with Source::mutex held
  };
  struct Source {
    std::mutex mutex;
    std::optional<StateChunker> chunker;  // until the last chunk
    std::function<void()> on_encoding;    // until the first
    bool is_broken = false;               // a chunk got no memory
  };
  static std::shared_ptr<Link> Encode(Source& source);

  std::shared_ptr<Source> source_;
  std::shared_ptr<Link> at_;  // the chunk that was taken last; before the first one an empty one
};

}  // namespace drape::api
