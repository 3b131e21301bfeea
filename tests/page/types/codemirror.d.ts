// What the bundle `codemirror` exports, see tools/vendor/build.mjs.
export {basicSetup, minimalSetup} from "../node_modules/codemirror/dist/index.js";
export * from "@codemirror/autocomplete";
export * from "@codemirror/commands";
export * from "@codemirror/language";
export * from "@codemirror/lint";
export * from "@codemirror/search";
export * from "@codemirror/state";
export * from "@codemirror/theme-one-dark";
export * from "@codemirror/view";
export {python, pythonLanguage, globalCompletion, localCompletionSource} from "@codemirror/lang-python";
export {tags} from "@lezer/highlight";
