#include "server/config_file.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/dynamic_message.h>
#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/text_format.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <sstream>

namespace drape {
namespace {

namespace pb = google::protobuf;
using Field = pb::FieldDescriptorProto;

// Of a server, not of one start of it: what --help and the like print is not configuration.
bool IsSetting(const CLI::Option& option) {
  return option.get_configurable() && !option.get_lnames().empty();
}

Field::Type TypeOf(const CLI::Option& option) {
  if (option.get_items_expected_max() == 0) return Field::TYPE_BOOL;
  const std::string name = option.get_type_name();
  const std::string type = name.substr(0, name.find_first_of(":("));
  if (type == "UINT") return Field::TYPE_UINT64;
  if (type == "INT") return Field::TYPE_INT64;
  return type == "FLOAT" ? Field::TYPE_DOUBLE : Field::TYPE_STRING;
}

std::string FieldName(const CLI::Option& option) {
  std::string name = option.get_lnames().front();
  std::ranges::replace(name, '-', '_');
  return name;
}

std::string FlagName(std::string field) {
  std::ranges::replace(field, '_', '-');
  return field;
}

class ServerConfigSchema {
 public:
  explicit ServerConfigSchema(const CLI::App& app) {
    pb::FileDescriptorProto file;
    file.set_name("server_config.proto");
    pb::DescriptorProto& message = *file.add_message_type();
    message.set_name("ServerConfig");
    for (const CLI::Option* option : app.get_options()) {
      if (!IsSetting(*option)) continue;
      Field& field = *message.add_field();
      field.set_name(FieldName(*option));
      field.set_number(message.field_size());
      field.set_label(Field::LABEL_OPTIONAL);
      field.set_type(TypeOf(*option));
    }
    type_ = pool_.BuildFile(file)->message_type(0);
  }

  std::unique_ptr<pb::Message> NewMessage() {
    return std::unique_ptr<pb::Message>(factory_.GetPrototype(type_)->New());
  }

 private:
  pb::DescriptorPool pool_;
  pb::DynamicMessageFactory factory_{&pool_};
  const pb::Descriptor* type_ = nullptr;
};

class FirstProblem final : public pb::io::ErrorCollector {
 public:
  void AddError(int line, pb::io::ColumnNumber column, const std::string& message) override {
    if (!text.empty()) return;
    text = "line " + std::to_string(line + 1) + ", column " + std::to_string(column + 1) + ": " +
           message;
  }
  std::string text;
};

CLI::ConfigItem Item(std::string name, std::string value) {
  CLI::ConfigItem item;
  item.name = std::move(name);
  item.inputs.push_back(std::move(value));
  return item;
}

std::vector<CLI::ConfigItem> FromJson(const std::string& text) {
  const auto object = nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (object.is_discarded()) throw CLI::FileError("the config file is not valid JSON");
  std::vector<CLI::ConfigItem> items;
  for (const auto& [name, value] : object.items()) {
    items.push_back(Item(name, value.is_string() ? value.get<std::string>() : value.dump()));
  }
  return items;
}

std::string ValueOf(const pb::Message& message, const pb::FieldDescriptor& field) {
  if (field.type() == pb::FieldDescriptor::TYPE_STRING) {
    return message.GetReflection()->GetString(message, &field);
  }
  std::string text;
  pb::TextFormat::PrintFieldValueToString(message, &field, -1, &text);
  return text;
}

std::vector<CLI::ConfigItem> FromProtobufText(const CLI::App& app, const std::string& text) {
  ServerConfigSchema schema(app);
  const auto message = schema.NewMessage();
  pb::TextFormat::Parser parser;
  FirstProblem problem;
  parser.RecordErrorsTo(&problem);
  if (!parser.ParseFromString(text, message.get())) {
    throw CLI::FileError("the config file: " + problem.text);
  }
  std::vector<const pb::FieldDescriptor*> fields;
  message->GetReflection()->ListFields(*message, &fields);
  std::vector<CLI::ConfigItem> items;
  for (const pb::FieldDescriptor* field : fields) {
    items.push_back(Item(FlagName(field->name()), ValueOf(*message, *field)));
  }
  return items;
}

// The first sign that belongs to one of the forms, outside comments; 0: there is none.
char FirstSign(const std::string& text) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const size_t start = line.find_first_not_of(" \t\r");
    if (start == std::string::npos || line[start] == '#' || line[start] == ';') continue;
    const size_t sign = line.find_first_of("{:=[", start);
    if (sign != std::string::npos) return line[sign];
  }
  return 0;
}

// How many letters must be put in, left out or replaced to make one of the other.
size_t EditDistance(const std::string& one, const std::string& other) {
  std::vector<size_t> row(other.size() + 1);
  std::iota(row.begin(), row.end(), size_t{0});
  for (size_t i = 0; i < one.size(); ++i) {
    size_t diagonal = std::exchange(row[0], i + 1);
    for (size_t k = 0; k < other.size(); ++k) {
      const size_t replaced = diagonal + (one[i] == other[k] ? 0 : 1);
      diagonal = row[k + 1];
      row[k + 1] = std::min({replaced, row[k] + 1, row[k + 1] + 1});
    }
  }
  return row.back();
}

// "; did you mean 'max-sessions'?" for a name that is spelled nearly so, or with underscores.
std::string HintFor(const CLI::App& app, const std::string& name) {
  constexpr size_t kFar = 3;
  std::string nearest;
  size_t least = kFar;
  for (const CLI::Option* option : app.get_options()) {
    if (!IsSetting(*option)) continue;
    const std::string& known = option->get_lnames().front();
    const size_t distance = EditDistance(FlagName(name), known);
    if (distance >= least) continue;
    least = distance;
    nearest = known;
  }
  return nearest.empty() ? "" : "; did you mean '" + nearest + "'?";
}

std::string Quoted(const std::string& text) {
  return pb::TextFormat::FieldValuePrinter().PrintString(text);
}

}  // namespace

std::vector<CLI::ConfigItem> ConfigFile::from_config(std::istream& input) const {
  const std::string text{std::istreambuf_iterator<char>(input), {}};
  const char sign = FirstSign(text);
  if (sign == ':') return FromProtobufText(app_, text);
  std::istringstream lines(text);
  auto settings = sign == '{' ? FromJson(text) : CLI::ConfigBase::from_config(lines);
  for (const CLI::ConfigItem& item : settings) {
    const CLI::Option* option = app_.get_option_no_throw("--" + item.name);
    if (option == nullptr || !IsSetting(*option)) {
      throw CLI::FileError("the config file: there is no setting '" + item.name + "'" +
                           HintFor(app_, item.name));
    }
  }
  return settings;
}

std::string ConfigAsText(const CLI::App& app) {
  std::string text = "# draped: a message ServerConfig as protobuf text, for --config.\n";
  for (const CLI::Option* option : app.get_options()) {
    if (!IsSetting(*option)) continue;
    const bool is_flag = TypeOf(*option) == Field::TYPE_BOOL;
    std::string value = option->count() > 0 ? option->results().front()
                        : is_flag           ? "false"
                                            : option->get_default_str();
    if (!option->get_description().empty()) text += "\n# " + option->get_description() + '\n';
    if (value.empty()) text += "# ";
    if (TypeOf(*option) == Field::TYPE_STRING) value = Quoted(value);
    text += FieldName(*option) + ": " + value + '\n';
  }
  return text;
}

}  // namespace drape
