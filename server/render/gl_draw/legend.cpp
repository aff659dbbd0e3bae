#include "server/render/gl_draw/legend.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "server/render/gl_draw/palette.h"
#include "shaders/interface/draw_bindings.h"

namespace drape::render {

namespace {

constexpr uint32_t kMostListedGroups = 16;
constexpr uint32_t kGroupsPerColumn = 8;

std::string TickLabel(double value, double step) {
  std::array<char, 64> text = {};
  const double largest = std::abs(value) + step;
  if (largest >= 1e5 || step < 1e-4) {
    std::snprintf(text.data(), text.size(), "%.3g", value);
  } else {
    // As many decimals as the step has; 2.5 and 0.25 have one more than 2 and 0.2.
    int digits = std::max(0, -static_cast<int>(std::floor(std::log10(step) + 1e-9)));
    const double scaled = step * std::pow(10, digits);
    if (std::abs(scaled - std::round(scaled)) > 1e-6) ++digits;
    std::snprintf(text.data(), text.size(), "%.*f", digits, value);
  }
  return text.data();
}

std::vector<Tick> TicksEvery(double step, double low, double high) {
  std::vector<Tick> ticks;
  // The ends are included if they are multiples themselves.
  constexpr double kSlack = 1e-6;
  const double first = std::ceil(low / step - kSlack);
  const double last = std::floor(high / step + kSlack);
  for (double k = first; k <= last && ticks.size() <= 5; ++k) {
    const double value = k == 0 ? 0 : k * step;
    ticks.push_back({value, TickLabel(value, step)});
  }
  return ticks;
}

// Collects rectangles; [px] from the upper left corner of the picture.
class LegendSheet {
 public:
  explicit LegendSheet(const GlyphAtlas& glyphs) : glyphs_(glyphs) {}

  void AddPanel(float left, float top, float right, float bottom, float corner_radius,
                shader::vec4 colour) {
    labels_.push_back({.box = {left, top, right, bottom},
                       .texture = {},
                       .colour = colour,
                       .kind = DRAPE_DRAW_LABEL_PANEL,
                       .corner_radius = corner_radius,
                       .padding0 = 0,
                       .padding1 = 0});
  }

  // The lower end of the scale is at the bottom.
  void AddScale(float left, float top, float right, float bottom, uint32_t kind) {
    labels_.push_back({.box = {left, top, right, bottom},
                       .texture = {0, 1, 1, 0},
                       .colour = {0, 0, 0, 1},
                       .kind = kind,
                       .corner_radius = 0,
                       .padding0 = 0,
                       .padding1 = 0});
  }

  void AddText(std::string_view text, float left, float base_line) {
    float pen = left;
    for (const char character : text) {
      const Glyph& glyph = glyphs_.GlyphOf(character);
      // At whole pixels, because the texture is not filtered.
      const float x = std::round(pen + glyph.offset_x);
      const float y = std::round(base_line + glyph.offset_y);
      const auto u = [&](uint32_t texel) {
        return static_cast<float>(texel) / static_cast<float>(glyphs_.width());
      };
      const auto v = [&](uint32_t texel) {
        return static_cast<float>(texel) / static_cast<float>(glyphs_.height());
      };
      labels_.push_back(
          {.box = {x, y, x + static_cast<float>(glyph.width), y + static_cast<float>(glyph.height)},
           .texture = {u(glyph.left), v(glyph.top), u(glyph.left + glyph.width),
                       v(glyph.top + glyph.height)},
           .colour = LinearFromHex(0x1f2933),
           .kind = DRAPE_DRAW_LABEL_GLYPH,
           .corner_radius = 0,
           .padding0 = 0,
           .padding1 = 0});
      pen += glyph.advance;
    }
  }

  std::vector<shader::LabelRecord> Take() { return std::move(labels_); }

 private:
  const GlyphAtlas& glyphs_;
  std::vector<shader::LabelRecord> labels_;
};

shader::vec4 PanelColour() {
  shader::vec4 colour = LinearFromHex(0xffffff);
  colour.w = 0.78f;
  return colour;
}

// Lengths in a legend, derived from the size of its text [px].
struct LegendLengths {
  explicit LegendLengths(const GlyphAtlas& glyphs)
      : text(static_cast<float>(glyphs.size_px())), digit(glyphs.digit_height()) {}

  float text;   // height of the text
  float digit;  // width of a digit
  float margin = std::round(text);
  float padding = std::round(0.7f * text);
  float corner = std::round(0.4f * text);
  float line = std::round(1.4f * text);
  float swatch = std::round(1.1f * text);
  float gap = std::round(0.4f * text);
};

std::vector<shader::LabelRecord> LayOutScale(const PictureSpec& spec, const ValueRange& range,
                                             const GlyphAtlas& glyphs) {
  const LegendLengths lengths(glyphs);
  const bool is_strain = spec.colouring == Colouring::kStrain;
  const bool is_contact = spec.colouring == Colouring::kContact;
  const double unit = is_strain ? 100 : is_contact ? 1000 : 1;
  const std::string_view title = is_strain    ? "strain [%]"
                                 : is_contact ? "contact [mN]"
                                              : "speed [m/s]";
  const std::vector<Tick> ticks = RoundTicks(unit * range.low, unit * range.high);
  float label_width = 0;
  for (const Tick& tick : ticks) label_width = std::max(label_width, glyphs.WidthOf(tick.label));
  const float tick_length = lengths.gap;
  const float scale_row = lengths.swatch + tick_length + lengths.gap + label_width;
  const float width = std::ceil(2 * lengths.padding + std::max(glyphs.WidthOf(title), scale_row));
  const float scale_height = std::round(0.36f * static_cast<float>(spec.height_px));
  const float height = 2 * lengths.padding + lengths.line + scale_height + 0.5f * lengths.digit;
  const float right = static_cast<float>(spec.width_px) - lengths.margin;
  const float left = right - width;
  const float top = lengths.margin;

  LegendSheet sheet(glyphs);
  sheet.AddPanel(left, top, right, top + std::round(height), lengths.corner, PanelColour());
  const float inner_left = left + lengths.padding;
  sheet.AddText(title, inner_left, top + lengths.padding + lengths.digit);
  const float scale_top = top + lengths.padding + lengths.line;
  const float scale_bottom = scale_top + scale_height;
  const float scale_right = inner_left + lengths.swatch;
  sheet.AddScale(inner_left, scale_top, scale_right, scale_bottom,
                 is_strain ? DRAPE_DRAW_LABEL_STRAIN_SCALE : DRAPE_DRAW_LABEL_SPEED_SCALE);
  const float thin = std::max(1.0f, std::round(lengths.text / 15));
  for (const Tick& tick : ticks) {
    const double share = (tick.value / unit - range.low) / (range.high - range.low);
    const float y = std::round(scale_bottom - static_cast<float>(share) * scale_height);
    sheet.AddPanel(scale_right, y - thin / 2, scale_right + tick_length, y + thin / 2, 0,
                   LinearFromHex(0x1f2933));
    sheet.AddText(tick.label, scale_right + tick_length + lengths.gap,
                  std::round(y + lengths.digit / 2));
  }
  return sheet.Take();
}

std::vector<shader::LabelRecord> LayOutGroups(const PictureSpec& spec, uint32_t group_count,
                                              const GlyphAtlas& glyphs) {
  const LegendLengths lengths(glyphs);
  const uint32_t listed = std::min(group_count, kMostListedGroups);
  const uint32_t columns = (listed + kGroupsPerColumn - 1) / kGroupsPerColumn;
  const uint32_t rows = std::min(listed, kGroupsPerColumn);
  const std::string_view title = "colour group";
  const std::string more =
      group_count > listed ? "+" + std::to_string(group_count - listed) + " more" : "";
  const float column_width = lengths.swatch + lengths.gap + glyphs.WidthOf("00") + 2 * lengths.gap;
  const float inner_width = std::max(
      {glyphs.WidthOf(title), glyphs.WidthOf(more), static_cast<float>(columns) * column_width});
  const float row_count = static_cast<float>(rows) + (more.empty() ? 1.0f : 2.0f);
  const float right = static_cast<float>(spec.width_px) - lengths.margin;
  const float left = right - std::ceil(2 * lengths.padding + inner_width);
  const float top = lengths.margin;

  LegendSheet sheet(glyphs);
  sheet.AddPanel(left, top, right,
                 top + 2 * lengths.padding + row_count * lengths.line - lengths.gap, lengths.corner,
                 PanelColour());
  const float inner_left = left + lengths.padding;
  sheet.AddText(title, inner_left, top + lengths.padding + lengths.digit);
  const float first_row = top + lengths.padding + lengths.line;
  for (uint32_t group = 0; group < listed; ++group) {
    const float x = inner_left + static_cast<float>(group / kGroupsPerColumn) * column_width;
    const float y = first_row + static_cast<float>(group % kGroupsPerColumn) * lengths.line;
    sheet.AddPanel(x, y, x + lengths.swatch, y + lengths.swatch, std::round(lengths.corner / 2),
                   GroupColour(group));
    sheet.AddText(std::to_string(group), x + lengths.swatch + lengths.gap,
                  std::round(y + (lengths.swatch + lengths.digit) / 2));
  }
  if (!more.empty()) {
    sheet.AddText(
        more, inner_left,
        first_row + static_cast<float>(rows) * lengths.line + lengths.digit + lengths.gap / 2);
  }
  return sheet.Take();
}

}  // namespace

std::vector<Tick> RoundTicks(double low, double high) {
  // From fine to coarse, until there are few enough.
  double power = std::pow(10, std::floor(std::log10((high - low) / 10)));
  for (;; power *= 10) {
    for (const double factor : {1.0, 2.0, 2.5, 5.0}) {
      std::vector<Tick> ticks = TicksEvery(factor * power, low, high);
      if (ticks.size() <= 5) return ticks;
    }
  }
}

uint32_t LegendTextSize(uint32_t width_px, uint32_t height_px) {
  if (width_px < 320 || height_px < 240) return 0;
  const double scale = std::min(width_px / 960.0, height_px / 720.0);
  return static_cast<uint32_t>(std::lround(std::clamp(15 * scale, 9.0, 90.0)));
}

double LegendWidth(const PictureSpec& spec) {
  return 8.5 * LegendTextSize(spec.width_px, spec.height_px);
}

std::vector<shader::LabelRecord> LayOutLegend(const PictureSpec& spec, const ValueRange& range,
                                              uint32_t group_count, const GlyphAtlas& glyphs) {
  std::vector<shader::LabelRecord> labels;
  switch (spec.colouring) {
    case Colouring::kMaterial:
      return {};
    case Colouring::kColourGroup:
      if (group_count > 0) labels = LayOutGroups(spec, group_count, glyphs);
      break;
    case Colouring::kStrain:
    case Colouring::kSpeed:
    case Colouring::kContact:
      labels = LayOutScale(spec, range, glyphs);
      break;
  }
  // The first rectangle is the panel behind all others.
  const bool fits = !labels.empty() && labels[0].box.x >= 0 &&
                    labels[0].box.w <= static_cast<float>(spec.height_px);
  return fits ? labels : std::vector<shader::LabelRecord>();
}

}  // namespace drape::render
