<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="zh_CN" sourcelanguage="en">
<context>
    <name>About</name>
    <message>
        <source>About Lightpen</source>
        <translation>关于 Lightpen</translation>
    </message>
    <message>
        <source>Calibrates the probe tip of a light pen.</source>
        <translation>校准光笔的测头。</translation>
    </message>
    <message>
        <source>Lightpen: MIT licence. Qt and PySide6: LGPL 3. Fonts: cut from Noto Sans and Noto Sans CJK, SIL Open Font License 1.1.</source>
        <translation>Lightpen：MIT 许可证。Qt 和 PySide6：LGPL 3。字体：截取自 Noto Sans 和 Noto Sans CJK，SIL 开放字体许可证 1.1。</translation>
    </message>
</context>
<context>
    <name>ActionBar</name>
    <message>
        <source>Back</source>
        <translation>返回</translation>
    </message>
</context>
<context>
    <name>ExposureBar</name>
    <message>
        <source>Exposure of the LEDs</source>
        <translation>LED 曝光</translation>
    </message>
    <message>
        <source>No LED is seen</source>
        <translation>看不到 LED</translation>
    </message>
    <message>
        <source>Saturated: {0} of {1} LEDs. Shorten the exposure.</source>
        <translation>饱和：{1} 个 LED 中有 {0} 个。请缩短曝光时间。</translation>
    </message>
    <message>
        <source>Too dark: {0} of {1} LEDs. Lengthen the exposure.</source>
        <translation>过暗：{1} 个 LED 中有 {0} 个。请延长曝光时间。</translation>
    </message>
    <message>
        <source>Good: {0} LEDs</source>
        <translation>合适：{0} 个 LED</translation>
    </message>
    <message>
        <source>dark</source>
        <translation>过暗</translation>
    </message>
    <message>
        <source>good</source>
        <translation>合适</translation>
    </message>
    <message>
        <source>saturated</source>
        <translation>饱和</translation>
    </message>
</context>
<context>
    <name>HelpWindow</name>
    <message>
        <source>Help</source>
        <translation>帮助</translation>
    </message>
</context>
<context>
    <name>ImageView</name>
    <message>
        <source>Live image</source>
        <translation>实时图像</translation>
    </message>
</context>
<context>
    <name>MainWindow</name>
    <message>
        <source>The program made a mistake of its own and goes on. All images taken so far are safe. Please send this report to its makers: {0}</source>
        <translation>程序自身出错，但会继续运行。已采集的图像全部安全。请将此报告发给开发者：{0}</translation>
    </message>
    <message>
        <source>The program made a mistake of its own and goes on. All images taken so far are safe. No report could be written: the disk is full or not yours to write.</source>
        <translation>程序自身出错，但会继续运行。已采集的图像全部安全。无法写入报告：磁盘已满或没有写入权限。</translation>
    </message>
    <message>
        <source>Sounds are off.</source>
        <translation>声音已关闭。</translation>
    </message>
    <message>
        <source>Sounds are on.</source>
        <translation>声音已打开。</translation>
    </message>
    <message>
        <source>Stay</source>
        <translation>留下</translation>
    </message>
    <message>
        <source>Close anyway</source>
        <translation>仍然关闭</translation>
    </message>
    <message>
        <source>Lightpen: pen tip calibration</source>
        <translation>Lightpen：光笔测头校准</translation>
    </message>
</context>
<context>
    <name>NoticeBar</name>
    <message>
        <source>Close</source>
        <translation>关闭</translation>
    </message>
</context>
<context>
    <name>OperatorView</name>
    <message>
        <source>Operator view</source>
        <translation>操作员视图</translation>
    </message>
</context>
<context>
    <name>OptionsMenu</name>
    <message>
        <source>As the system</source>
        <translation>跟随系统</translation>
    </message>
    <message>
        <source>Light</source>
        <translation>浅色</translation>
    </message>
    <message>
        <source>Dark</source>
        <translation>深色</translation>
    </message>
    <message>
        <source>{0} m</source>
        <translation>{0} 米</translation>
    </message>
    <message>
        <source>Language</source>
        <translation>语言</translation>
    </message>
    <message>
        <source>Appearance</source>
        <translation>外观</translation>
    </message>
    <message>
        <source>Viewing distance</source>
        <translation>观看距离</translation>
    </message>
    <message>
        <source>Mute the sounds</source>
        <translation>关闭声音</translation>
    </message>
    <message>
        <source>About Lightpen</source>
        <translation>关于 Lightpen</translation>
    </message>
</context>
<context>
    <name>PostureDial</name>
    <message>
        <source>Postures</source>
        <translation>姿态</translation>
    </message>
    <message>
        <source>{0} of {1} postures are done.</source>
        <translation>{1} 个姿态中已完成 {0} 个。</translation>
    </message>
    <message>
        <source>camera</source>
        <translation>相机</translation>
    </message>
    <message>
        <source>turn about the pen&apos;s own axis</source>
        <translation>绕光笔自身轴线转动</translation>
    </message>
</context>
<context>
    <name>Sidebar</name>
    <message>
        <source>Pen tip calibration</source>
        <translation>光笔测头校准</translation>
    </message>
    <message>
        <source>Operator view</source>
        <translation>操作员视图</translation>
    </message>
    <message>
        <source>Help</source>
        <translation>帮助</translation>
    </message>
    <message>
        <source>Options</source>
        <translation>选项</translation>
    </message>
</context>
<context>
    <name>StepButton</name>
    <message>
        <source>done</source>
        <translation>已完成</translation>
    </message>
    <message>
        <source>now</source>
        <translation>进行中</translation>
    </message>
    <message>
        <source>to do</source>
        <translation>待完成</translation>
    </message>
    <message>
        <source>closed</source>
        <translation>未开放</translation>
    </message>
</context>
<context>
    <name>StepList</name>
    <message>
        <source>Steps</source>
        <translation>步骤</translation>
    </message>
</context>
</TS>
