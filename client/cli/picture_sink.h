// The pictures of a run: one of its last state, or a numbered series.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "client/cli/output_file.h"
#include "drape/session.h"

namespace drape::cli {

// One thread. Files appear when they are complete.
class PictureSink {
 public:
  enum class Need { kRequired, kIfPossible };

  // `request`: the content of a picture. kIfPossible: if the server cannot draw (NO_EGL_DEVICE),
  // there are no pictures, and cannot_draw() has the reason. Throws drape::Error (CANNOT_WRITE) for
  // a path that cannot be written.
  PictureSink(std::filesystem::path path, bool is_series, v1::RenderRequest request,
              Need need = Need::kRequired);

  // Draws a small picture of the state before the first step, only to check that the server can
  // draw it: an error should not cost a run. Throws what Session::Render throws.
  void Begin(const Session& session);
  // After each sample; the last one is the last state.
  void AddSample(const Session& session, uint64_t step);
  // After the last sample.
  void Finish(const Session& session);

  // The reason for no pictures; only with kIfPossible.
  const std::optional<Error>& cannot_draw() const { return cannot_draw_; }
  // In order.
  const std::vector<std::filesystem::path>& written() const { return written_; }

 private:
  void Draw(const Session& session, OutputFile& file);

  const std::filesystem::path path_;
  const bool is_series_;
  v1::RenderRequest request_;
  const Need need_;
  std::optional<Error> cannot_draw_;
  std::unique_ptr<OutputFile> file_;  // of the one picture
  std::vector<std::filesystem::path> written_;
};

// Puts the view of `drawn`, or a wider one, into a request with a fitted camera.
void IncludeView(const v1::RenderResponse& drawn, v1::RenderRequest& request);

}  // namespace drape::cli
