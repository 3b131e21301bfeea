// What the bundle `three` exports, see tools/vendor/build.mjs.
export * from "../node_modules/@types/three/index.js";
export {OrbitControls} from "three/addons/controls/OrbitControls.js";
