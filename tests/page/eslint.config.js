// Rules for the page of the editor and for its unit tests: those that find mistakes; Prettier has the style.
import js from "@eslint/js";
import globals from "globals";

export default [
  {ignores: ["**/vendor/", "**/node_modules/"]},
  js.configs.recommended,
  {
    languageOptions: {ecmaVersion: 2024, sourceType: "module"},
    rules: {
      eqeqeq: "error",
      "no-console": "error",
      "no-implicit-globals": "error",
      "no-shadow": "error",
      "no-unused-expressions": "error",
      "no-unused-vars": ["error", {argsIgnorePattern: "^_", ignoreRestSiblings: true}],
      "no-var": "error",
      "object-shorthand": "error",
      "prefer-const": "error",
      "prefer-template": "error",
    },
  },
  {
    files: ["**/_editor/static/**", "**/plugins/*/src/*/static/**"],
    languageOptions: {globals: globals.browser},
    rules: {
      // _editor/assets.py sends modules without such lines.
      "no-restricted-syntax": [
        "error",
        {
          selector: "TemplateElement[value.raw=/^\\s*\\u002F[\\u002F*]/m]",
          message: "A line of a template must not look like a comment.",
        },
      ],
    },
  },
  {files: ["**/tests/page/**"], languageOptions: {globals: globals.node}},
];
