#include "client/cli/picture_sink.h"

#include <utility>

#include "client/cli/series_path.h"

namespace drape::cli {
namespace {

// The smallest picture that a server draws.
constexpr uint32_t kTrialEdge_px = 16;

}  // namespace

void IncludeView(const v1::RenderResponse& drawn, v1::RenderRequest& request) {
  if (!request.has_camera()) *request.mutable_fit()->mutable_include_m() = drawn.bounds_m();
}

PictureSink::PictureSink(std::filesystem::path path, bool is_series, v1::RenderRequest request,
                         Need need)
    : path_(std::move(path)), is_series_(is_series), request_(std::move(request)), need_(need) {
  request_.set_all_cloths(true);
  // For a series, only checks that it can be written.
  file_ = std::make_unique<OutputFile>(is_series ? SeriesPath(path_, 0) : path_);
  if (is_series) file_.reset();
}

void PictureSink::Begin(const Session& session) {
  v1::RenderRequest trial = request_;
  trial.set_width_px(kTrialEdge_px);
  trial.set_height_px(kTrialEdge_px);
  // Before the first step nothing is known of contacts; a scale takes as much room as the other.
  if (trial.colouring() == v1::RenderRequest::CONTACT)
    trial.set_colouring(v1::RenderRequest::SPEED);
  try {
    const v1::RenderResponse drawn = session.Render(std::move(trial));
    // Motion away from the start stays in view.
    if (is_series_) IncludeView(drawn, request_);
  } catch (const Error& error) {
    if (need_ == Need::kRequired || error.reason() != "NO_EGL_DEVICE") throw;
    cannot_draw_ = error;
  }
}

void PictureSink::AddSample(const Session& session, uint64_t step) {
  if (!is_series_ || cannot_draw_) return;
  const std::filesystem::path path = SeriesPath(path_, step);
  OutputFile file(path);
  Draw(session, file);
  written_.push_back(path);
}

void PictureSink::Finish(const Session& session) {
  if (is_series_ || cannot_draw_) return;
  Draw(session, *file_);
  written_.push_back(path_);
}

void PictureSink::Draw(const Session& session, OutputFile& file) {
  const v1::RenderResponse drawn = session.Render(request_);
  if (is_series_) IncludeView(drawn, request_);
  file.Write(drawn.png());
  file.Close();
}

}  // namespace drape::cli
