#include "client/cli/picture_flags.h"

#include <cmath>
#include <filesystem>
#include <map>
#include <sstream>

namespace drape::cli {
namespace {

const std::map<std::string, v1::RenderRequest::Colouring>& Colourings() {
  static const std::map<std::string, v1::RenderRequest::Colouring> kColourings = {
      {"material", v1::RenderRequest::MATERIAL},
      {"strain", v1::RenderRequest::STRAIN},
      {"group", v1::RenderRequest::COLOUR_GROUP},
      {"speed", v1::RenderRequest::SPEED},
      {"contact", v1::RenderRequest::CONTACT}};
  return kColourings;
}

// The finite numbers of "1,2.5,-3"; none if the text is anything else.
std::vector<double> ParseNumbers(const std::string& text) {
  std::vector<double> numbers;
  std::stringstream parts(text + ",");
  for (std::string part; std::getline(parts, part, ',');) {
    double number = 0;
    if (!CLI::detail::lexical_cast(part, number) || !std::isfinite(number)) return {};
    numbers.push_back(number);
  }
  return numbers;
}

// An option of exactly `count` numbers with commas between them.
CLI::Option* AddNumbers(CLI::App& command, const std::string& name, size_t count,
                        std::vector<double>& numbers, const std::string& shape,
                        const std::string& meaning) {
  return command
      .add_option_function<std::string>(
          name, [&numbers](const std::string& text) { numbers = ParseNumbers(text); }, meaning)
      ->check(CLI::Validator(
          [count, shape](const std::string& text) {
            return ParseNumbers(text).size() == count
                       ? std::string()
                       : text + " is not " + shape + ", " + std::to_string(count) + " numbers";
          },
          ""))
      ->type_name(shape);
}

// Width and height of "960x720"; empty if it is anything else. The server knows the range.
std::optional<std::array<uint32_t, 2>> ParseSize(const std::string& text) {
  const size_t cross = text.find('x');
  if (cross == std::string::npos) return {};
  std::array<uint32_t, 2> size{};
  const std::array<std::string, 2> parts = {text.substr(0, cross), text.substr(cross + 1)};
  for (size_t k = 0; k < 2; ++k) {
    const bool is_number = !parts[k].empty() && parts[k].size() <= 9 &&
                           parts[k].find_first_not_of("0123456789") == std::string::npos;
    if (!is_number) return {};
    size[k] = static_cast<uint32_t>(std::stoul(parts[k]));
  }
  return size;
}

std::string SizeProblem(const std::string& text) {
  constexpr uint32_t kMin = 16;
  constexpr uint32_t kMax = 4096;
  const auto size = ParseSize(text);
  const bool is_legal =
      size && (*size)[0] >= kMin && (*size)[0] <= kMax && (*size)[1] >= kMin && (*size)[1] <= kMax;
  return is_legal ? "" : text + " is not WxH with both in [16, 4096]";
}

}  // namespace

void PictureFlags::AddTo(CLI::App& command, CLI::Option* render) {
  std::vector<CLI::Option*> flags;
  flags.push_back(command
                      .add_option_function<std::string>(
                          "--render-size",
                          [this](const std::string& text) { size_px = *ParseSize(text); },
                          "Size of a picture [px] (default: 960x720)")
                      ->check(CLI::Validator(SizeProblem, ""))
                      ->type_name("WxH"));
  flags.push_back(
      command
          .add_option("--colour-by", colour_by,
                      "material (a colour per cloth), strain, group (constraints "
                      "that are solved together), speed or contact, how hard particles are "
                      "touched (default: material)")
          ->check(CLI::IsMember({"material", "strain", "group", "speed", "contact"}))
          ->type_name("WHAT"));
  flags.push_back(AddNumbers(command, "--colour-range", 2, range, "LOW,HIGH",
                             "Range of the colours of strain, speed or contact [-, m/s, N] "
                             "(default: fitted)"));
  CLI::Option* camera_flag = AddNumbers(command, "--camera", 6, camera, "EX,EY,EZ,TX,TY,TZ",
                                        "Eye and target [m] (default: fitted to the cloths)");
  CLI::Option* view_flag =
      AddNumbers(command, "--view", 3, view, "X,Y,Z",
                 "Direction of the fitted camera (default: -0.55,-0.42,-0.72)");
  camera_flag->excludes(view_flag);
  flags.push_back(camera_flag);
  flags.push_back(view_flag);
  flags.push_back(command.add_flag("--no-legend", has_no_legend, "No colour scale in the picture"));
  if (render == nullptr) return;
  for (CLI::Option* flag : flags) flag->needs(render);
}

v1::RenderRequest PictureFlags::Request() const {
  v1::RenderRequest request;
  request.set_width_px(size_px[0]);
  request.set_height_px(size_px[1]);
  request.set_colouring(Colourings().at(colour_by));
  request.mutable_range()->Add(range.begin(), range.end());
  request.set_hide_legend(has_no_legend);
  if (!camera.empty()) {
    request.mutable_camera()->mutable_eye_m()->Add(camera.begin(), camera.begin() + 3);
    request.mutable_camera()->mutable_target_m()->Add(camera.begin() + 3, camera.end());
  }
  if (!view.empty()) {
    request.mutable_fit()->mutable_view_direction()->Add(view.begin(), view.end());
  }
  return request;
}

CLI::Validator PictureFileValidator() {
  return CLI::Validator(
      [](const std::string& path) {
        return std::filesystem::path(path).extension() == ".png" ? std::string()
                                                                 : path + " does not end in .png";
      },
      "");
}

}  // namespace drape::cli
