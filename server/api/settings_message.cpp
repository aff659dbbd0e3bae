#include "server/api/settings_message.h"

#include <algorithm>
#include <string>

#include "server/api/field_checks.h"

namespace drape::api {
namespace {

using google::protobuf::FieldDescriptor;

const FieldDescriptor* FieldOf(std::string_view name) {
  const auto* field = v1::StepSettings::descriptor()->FindFieldByName(std::string(name));
  DRAPE_CHECK(field != nullptr, "every setting is a field of the protocol");
  return field;
}

// The value of a field that the message has.
void Read(const v1::StepSettings& message, const Setting<double>& setting, const FieldPath&,
          StepSettingsOverrides& overrides, Violations&) {
  overrides.Set(setting.member, message.GetReflection()->GetDouble(message, FieldOf(setting.name)));
}

void Read(const v1::StepSettings& message, const Setting<uint32_t>& setting, const FieldPath&,
          StepSettingsOverrides& overrides, Violations&) {
  overrides.Set(setting.member, message.GetReflection()->GetUInt32(message, FieldOf(setting.name)));
}

void Read(const v1::StepSettings& message, const Setting<bool>& setting, const FieldPath&,
          StepSettingsOverrides& overrides, Violations&) {
  overrides.Set(setting.member, message.GetReflection()->GetBool(message, FieldOf(setting.name)));
}

// Zero, *_UNSPECIFIED, leaves the preset's value.
template <class Value>
void Read(const v1::StepSettings& message, const Setting<Value>& setting, const FieldPath& path,
          StepSettingsOverrides& overrides, Violations& violations) {
  const FieldDescriptor* field = FieldOf(setting.name);
  const int number = message.GetReflection()->GetEnumValue(message, field);
  if (number == 0 ||
      !CheckKnownEnum(path.Child(setting.name), number, field->enum_type(), violations)) {
    return;
  }
  const std::string& name = field->enum_type()->FindValueByNumber(number)->name();
  const auto value = std::ranges::find(setting.value_names, name);
  DRAPE_CHECK(value != setting.value_names.end(), "every value of the protocol has its name");
  overrides.Set(setting.member, static_cast<Value>(value - setting.value_names.begin()));
}

void Write(const Setting<double>& setting, double value, v1::StepSettings& message) {
  message.GetReflection()->SetDouble(&message, FieldOf(setting.name), value);
}

void Write(const Setting<uint32_t>& setting, uint32_t value, v1::StepSettings& message) {
  message.GetReflection()->SetUInt32(&message, FieldOf(setting.name), value);
}

void Write(const Setting<bool>& setting, bool value, v1::StepSettings& message) {
  message.GetReflection()->SetBool(&message, FieldOf(setting.name), value);
}

template <class Value>
void Write(const Setting<Value>& setting, Value value, v1::StepSettings& message) {
  const FieldDescriptor* field = FieldOf(setting.name);
  const std::string name(setting.value_names[static_cast<size_t>(value)]);
  message.GetReflection()->SetEnum(&message, field, field->enum_type()->FindValueByName(name));
}

}  // namespace

StepSettings CheckSettings(const FieldPath& path, const v1::StepSettings& message,
                           Violations& violations) {
  StepSettingsOverrides overrides;
  ForEachSetting([&](const auto& setting) {
    if (!message.GetReflection()->HasField(message, FieldOf(setting.name))) return;
    Read(message, setting, path, overrides, violations);
  });
  const Result<StepSettings> resolved = ResolveSettings(overrides, path);
  if (resolved.ok()) return *resolved;
  violations.AddAll(resolved.status().violations());
  return {};
}

v1::StepSettings ToProto(const StepSettings& settings) {
  v1::StepSettings message;
  ForEachSetting([&](const auto& setting) { Write(setting, settings.*setting.member, message); });
  return message;
}

}  // namespace drape::api
