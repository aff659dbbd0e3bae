#include <algorithm>
#include <cmath>

#include "tests/stability/atlas/atlas_scenes.h"

namespace drape::test {
namespace {

constexpr AtlasForm kThin = AtlasForm::kThin;
constexpr AtlasForm kShort = AtlasForm::kShort;
constexpr AtlasForm kFull = AtlasForm::kFull;

constexpr double kFrame_s = 1.0 / 60;
constexpr double kBarRatio = 1e3;
constexpr double kBarGravities = 100;
constexpr double kEarth_m_per_s2 = 9.81;

Axis Steps() {
  return {"time step",
          {{"1/3840 s", 1.0 / 3840, kFull},
           {"1/960 s", 1.0 / 960, kShort},
           {"1/240 s", 1.0 / 240, kFull},
           {"1/120 s", 1.0 / 120, kFull},
           {"1/60 s", kFrame_s, kThin},
           {"1/30 s", 1.0 / 30, kShort},
           {"1/10 s", 1.0 / 10, kFull}}};
}

Axis Gravities() {
  return {"gravity",
          {{"0 g", 0, kFull},
           {"1 g", 1, kShort},
           {"10 g", 10, kFull},
           {"100 g", 100, kThin},
           {"1000 g", 1000, kShort}}};
}

Axis Sides() {
  return {"particles",
          {{"4 x 4", 4, kShort},
           {"8 x 8", 8, kFull},
           {"16 x 16", 16, kThin},
           {"32 x 32", 32, kShort},
           {"64 x 64", 64, kFull}}};
}

Axis Ratios() {
  return {"mass ratio",
          {{"1", 1, kFull},
           {"10", 10, kFull},
           {"100", 100, kShort},
           {"1e3", 1e3, kThin},
           {"1e4", 1e4, kShort},
           {"1e6", 1e6, kFull}}};
}

// The places of named cases.
Axis Places(std::string name, const std::vector<std::string>& labels) {
  Axis axis{std::move(name), {}};
  for (size_t k = 0; k < labels.size(); ++k) {
    axis.values.push_back({labels[k], static_cast<double>(k), kThin});
  }
  return axis;
}

std::vector<std::string> NamesOf(const std::vector<NamedCase>& cases) {
  std::vector<std::string> names;
  for (const NamedCase& named : cases) names.push_back(named.first);
  return names;
}

AtlasCase CaseAt(const std::vector<NamedCase>& cases, double place) {
  return cases.at(static_cast<size_t>(place)).second;
}

uint32_t SideOf(double value) {
  return static_cast<uint32_t>(value);
}

bool IsFrameOrLess(double step_s) {
  return step_s <= kFrame_s;
}
bool Never(double, double) {
  return false;
}

AtlasCase UnderGravity(Scene scene, double gravities, double step_s) {
  scene.parameters.gravity_m_per_s2 = {0, -gravities * kEarth_m_per_s2, 0};
  return {.scene = std::move(scene), .time_step_s = step_s};
}

AtlasCase SpringySheet(double stiffness_n_per_m, double step_s) {
  StructuralMaterial material;
  material.bending_stiffness_n_per_m = stiffness_n_per_m;
  material.shear_stiffness_n_per_m = stiffness_n_per_m;
  return {.scene = HungSheet(12, material), .time_step_s = step_s};
}

// The corners carry all: the elongation that is meant is compliance x weight / 2 there, twice that
// where the sheet swings through its lowest point at 3 g, and twice again when it bounces.
AtlasCase CompliantSheetAt(double compliance_m_per_n, double step_s) {
  StructuralMaterial material;
  material.stretch_compliance_m_per_n = compliance_m_per_n;
  AtlasCase sheet{.scene = HungSheet(12, material), .time_step_s = step_s};
  constexpr double kWeight_n = 0.2 * kEarth_m_per_s2;
  sheet.least_strain = 6 * compliance_m_per_n * kWeight_n / 2 * 11;
  return sheet;
}

AtlasCase Soak(double place, double substeps) {
  AtlasCase soak = CaseAt(SoakCases(), place);
  soak.substeps = static_cast<uint32_t>(substeps);
  return soak;
}

AtlasCase AtStep(AtlasCase atlas_case, double step_s) {
  atlas_case.time_step_s = step_s;
  return atlas_case;
}

std::vector<AtlasTable> LoadTables() {
  const auto is_light = [](double gravities, double step_s) {
    return gravities <= kBarGravities && IsFrameOrLess(step_s);
  };
  const auto is_near = [](double ratio, double step_s) {
    return ratio <= kBarRatio && IsFrameOrLess(step_s);
  };
  return {
      {"gravity", "sheet of 16 x 16 hung by two corners, gravity", Gravities(), Steps(),
       [](double g, double h) { return UnderGravity(HungSheet(16), g, h); }, is_light},
      {"resolution", "sheet hung by two corners, its resolution", Sides(), Steps(),
       [](double side, double h) { return UnderGravity(HungSheet(SideOf(side)), 1, h); },
       [](double, double h) { return IsFrameOrLess(h); }},
      {"gravity_resolution", "sheet hung by two corners at 1/60 s, gravity and resolution",
       Gravities(), Sides(),
       [](double g, double side) { return UnderGravity(HungSheet(SideOf(side)), g, kFrame_s); },
       [](double g, double) { return g <= kBarGravities; }},
      {"load", "rope of 20 links, mass ratio of the particle at its end", Ratios(), Steps(),
       [](double ratio, double h) { return UnderGravity(LoadedRope(ratio), 1, h); }, is_near},
      {"hem", "hung sheet at 1/60 s, mass ratio of its last row", Ratios(), Sides(),
       [](double ratio, double side) {
         return UnderGravity(HeavyHem(SideOf(side), ratio), 1, kFrame_s);
       },
       [](double ratio, double) { return ratio <= kBarRatio; }},
      {"mixed_masses", "hung sheet of 12 x 12, mass ratio of every other particle", Ratios(),
       Steps(), [](double ratio, double h) { return UnderGravity(MixedMasses(12, ratio), 1, h); },
       is_near}};
}

std::vector<AtlasTable> MaterialTables() {
  const Axis stiffnesses{"stiffness of bending and shear springs",
                         {{"0.1 N/m", 0.1, kFull},
                          {"1 N/m", 1, kShort},
                          {"10 N/m", 10, kFull},
                          {"100 N/m", 100, kThin},
                          {"1e4 N/m", 1e4, kShort},
                          {"1e6 N/m", 1e6, kFull}}};
  const Axis compliances{"compliance",
                         {{"1e-8 m/N", 1e-8, kFull},
                          {"1e-6 m/N", 1e-6, kShort},
                          {"1e-4 m/N", 1e-4, kThin},
                          {"1e-2 m/N", 1e-2, kShort},
                          {"1 m/N", 1, kFull}}};
  return {{"stiffness", "hung sheet of 12 x 12 with explicit springs", stiffnesses, Steps(),
           SpringySheet, Never},
          {"compliance", "hung sheet of 12 x 12 that may stretch", compliances, Steps(),
           CompliantSheetAt, Never}};
}

std::vector<AtlasTable> CaseTables() {
  const Axis speeds{"speed",
                    {{"1 m/s", 1, kFull},
                     {"10 m/s", 10, kThin},
                     {"100 m/s", 100, kShort},
                     {"1e3 m/s", 1e3, kShort},
                     {"1e4 m/s", 1e4, kFull}}};
  const Axis distances{"distance",
                       {{"0.1 m", 0.1, kFull},
                        {"1 m", 1, kThin},
                        {"10 m", 10, kShort},
                        {"100 m", 100, kFull},
                        {"1000 m", 1000, kShort}}};
  const Axis soak{"substeps", {{"1e4", 1e4, kThin}, {"1e5", 1e5, kFull}, {"1e6", 1e6, kFull}}};
  return {
      {"constraints", "constraints that contradict each other, repeat each other or lock",
       Places("constraints", NamesOf(ConstraintCases())), Steps(),
       [](double place, double h) { return AtStep(CaseAt(ConstraintCases(), place), h); }, Never},
      {"starts", "degenerate starts", Places("start", NamesOf(StartCases())), Steps(),
       [](double place, double h) {
         AtlasCase start = AtStep(CaseAt(StartCases(), place), h);
         start.duration_s = 10;
         return start;
       },
       [](double, double h) { return IsFrameOrLess(h); }},
      {"impact", "sheet of 12 x 12 thrown at a sphere", speeds, Steps(),
       [](double speed, double h) { return AtStep(Impact(0, speed), h); }, Never},
      {"impact_collider", "sheet of 12 x 12 thrown at a collider, 1/60 s", speeds,
       Places("collider", ImpactColliders()),
       [](double speed, double place) { return Impact(static_cast<size_t>(place), speed); }, Never},
      {"teleport", "hung sheet of 12 x 12 whose pins jump there and back for a second, distance",
       distances, Steps(), TeleportingPins, Never},
      {"soak", "many substeps, 1/60 s", Places("scene", NamesOf(SoakCases())), soak, Soak,
       [](double, double) { return true; }}};
}

}  // namespace

std::vector<AtlasTable> AtlasTables(AtlasForm form) {
  std::vector<AtlasTable> tables;
  for (auto& group : {LoadTables(), MaterialTables(), CaseTables()}) {
    tables.insert(tables.end(), group.begin(), group.end());
  }
  for (AtlasTable& table : tables) {
    for (Axis* axis : {&table.rows, &table.columns}) {
      std::erase_if(axis->values, [&](const AxisValue& value) { return value.form > form; });
    }
  }
  return tables;
}

std::vector<AtlasMethod> AtlasMethods(AtlasForm form) {
  const StepSettings realtime = PresetSettings(Preset::kRealtime);
  std::vector<AtlasMethod> methods = {{"REALTIME", realtime}};
  if (form == AtlasForm::kThin) return methods;
  methods.push_back({"PAPER", PresetSettings(Preset::kPaper)});
  methods.push_back({"ACCURATE", PresetSettings(Preset::kAccurate)});
  const auto vary = [&](const char* name, const std::function<void(StepSettings&)>& change) {
    methods.push_back({name, realtime});
    change(methods.back().settings);
  };
  vary("sweep=COLOURS", [](StepSettings& s) { s.sweep = Sweep::kColours; });
  vary("use_tethers=false", [](StepSettings& s) { s.use_tethers = false; });
  if (form == AtlasForm::kShort) return methods;
  vary("integration=ONE_STEP", [](StepSettings& s) { s.integration = Integration::kOneStep; });
  vary("max_iterations=2", [](StepSettings& s) { s.max_iterations = 2; });
  return methods;
}

}  // namespace drape::test
